// gapfarm workers: workers from the cluster that is there, as many as there is work for.
#include <nlohmann/json.hpp>

#include "common/base/build_info.h"
#include "common/base/ranges.h"
#include "common/net/keys.h"
#include "common/process/process_pool.h"
#include "master/cli/evolution/fleet_options.h"
#include "master/cli/subcommand.h"
#include "master/store/records.h"
#include "master/store/run_lock.h"
#include "master/store/run_reader.h"

namespace gapfarm {
namespace {

struct WorkersCommand {
  FleetChoice fleet;
  std::string connect, run;
  std::string keys = KeyFolder::default_path();
  bool insecure = false;
  bool dry_run = false;
  double wait_limit_s = FleetLoopOptions().master_limit_s;
  std::vector<std::string> options;
};

Result<std::string> endpoint_of(const WorkersCommand& command) {
  if (command.connect.empty() == command.run.empty()) {
    return Error{"give the master's address by --connect tcp://HOST:PORT, or its run by --run RUN"};
  }
  const std::string& folder = command.run;
  if (folder.empty()) return command.connect;
  ASSIGN_OR_RETURN(const auto other, command_status(folder, unix_now_s()));
  LiveStatus live;
  if (other) {
    live = *other;
  } else {
    ASSIGN_OR_RETURN(const RunReader reader, RunReader::open(folder));
    ASSIGN_OR_RETURN(live, reader.progress());
  }
  if (live.running() && !live.listen.empty()) return reachable(live.listen, live.host);
  const std::string error = folder + ": no master of it listens for workers now; ";
  if (other) return Error{error + "run " + other->command + " with --listen tcp://*:5555"};
  const std::string more = live.state == RunState::kFinished ? " --generations N" : "";
  return Error{error + "`gapfarm resume " + shell_quoted(folder) + more +
               " --listen tcp://*:5555`, or let it bring them itself with --workers-on"};
}

Result<int> run_workers(WorkersCommand command, CliContext& context) {
  append(command.fleet.extra, command.options);
  ASSIGN_OR_RETURN(const std::string endpoint, endpoint_of(command));
  ASSIGN_OR_RETURN(FleetLoopOptions options,
                   fleet_of(command.fleet, endpoint, command.keys, command.insecure));
  options.master_limit_s = command.wait_limit_s;
  const FleetOptions& fleet = options.fleet;
  const Fleet planned(fleet, {}, {});
  const unsigned jobs = fleet.limits.max_workers / fleet.limits.workers_per_job;
  if (command.dry_run) {
    context.console.result(planned.submission_text(jobs),
                           {{"dry_run", true},
                            {"jobs", jobs},
                            {"name", fleet.name},
                            {"submission", planned.submission_text(jobs)}});
    return kExitDone;
  }
  context.begun = true;
  if (fleet.site.hosts.empty()) RETURN_IF_ERROR(make_log_folder(fleet.logs));
  const std::string who = fleet.site.system + ": ";
  context.console.note(who + "up to " + std::to_string(fleet.limits.max_workers) +
                       " workers for the master at " + endpoint + ", as jobs named " + fleet.name);
  ASSIGN_OR_RETURN(const FleetEnd end, run_fleet(options, context.stop, [&](const auto& text) {
                     context.console.note(who + text);
                   }));
  context.console.note(who + "nothing stands on the cluster any more");
  if (end == FleetEnd::kNoMaster) return kExitNoMaster;
  return end == FleetEnd::kStopped ? kExitSignalBase + context.stop.signal() : kExitDone;
}

}  // namespace

SubcommandRun setup_workers(CLI::App& app) {
  auto command = std::make_shared<WorkersCommand>();
  command->fleet.declare(app, "--on");
  app.add_option("--connect", command->connect, "The master: tcp://HOST:PORT")
      ->type_name("ENDPOINT");
  app.add_option("--run", command->run,
                 "The run, or folder of another command, whose master it is; in place of --connect")
      ->type_name("RUN");
  app.add_option("--wait-limit", command->wait_limit_s,
                 "Give up when no master has answered for so many seconds")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->type_name("SECONDS");
  app.add_option("--keys", command->keys, "Folder with worker.key and master.pub")
      ->type_name("FOLDER");
  app.add_flag("--insecure", command->insecure, "For a master that has no keys");
  app.add_flag("--dry-run", command->dry_run, "Print what would be submitted");
  app.add_option("OPTIONS", command->options,
                 "After --: options for the command that submits (sbatch, qsub, ...)");
  app.footer(
      "It asks the master how much there is to do, submits, replaces what ended, and takes away\n"
      "what is not needed, and all of it when the run ends or this is stopped.  Exit status 69: "
      "no\n"
      "master answered for the --wait-limit.\n\n"
      "Examples:\n"
      "  gapfarm workers --on slurm --max 200 --connect tcp://login1:5555 --wall-time 4:00:00\n"
      "  gapfarm workers --on slurm --max 64 --connect tcp://login1:5555 -- --partition=short\n"
      "  gapfarm workers --on ssh --host rack1 --host rack2 --workers-per-job 8 --max 16 \\\n"
      "      --connect tcp://10.0.0.5:5555\n"
      "  gapfarm workers --on kube --max 50 --connect tcp://gapfarm:5555 --dry-run");
  return [command](CliContext& context) { return run_workers(*command, context); };
}

}  // namespace gapfarm
