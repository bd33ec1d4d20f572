// gapfarm submit: a run's master as a job of the cluster, with its workers as jobs beside it.
#include <spdlog/fmt/fmt.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/net/keys.h"
#include "common/process/process_pool.h"
#include "master/cli/evolution/fleet_options.h"
#include "master/cli/subcommand.h"

namespace gapfarm {
namespace {

constexpr double kSubmitLimit_s = 120;

struct SubmitCommand {
  FleetChoice fleet;
  std::string keys = KeyFolder::default_path();
  bool insecure = false;
  bool dry_run = false;
  std::string listen = "tcp://*:*";
  std::string master_time;
  unsigned notice_s = 60;
  std::vector<std::string> evolve;
};

std::string quoted(const std::vector<std::string>& values) {
  return joined(values, " ", shell_quoted);
}

// The run's folder as a whole path, also in `values`.
Result<std::string> run_of(std::vector<std::string>* values) {
  for (std::size_t i = 0; i + 1 < values->size(); ++i) {
    if ((*values)[i] != "--out") continue;
    std::string& out = (*values)[i + 1];
    out = std::filesystem::absolute(out).string();
    return out;
  }
  return Error{"submit needs -- evolve CONFIG --out RUN"};
}

// TERM and USR1 (the time is nearly up) stop the run at a committed generation; after USR1 the job
// is queued again and resumes it.  A cluster that queues it again itself sends TERM.
std::string master_script(const std::string& run, const std::string& evolve,
                          const std::string& resume, const std::string& requeue) {
  return fmt::format(
      "#!/bin/sh\n"
      "again= child=\n"
      "trap 'again=yes; [ -z \"$child\" ] || kill -TERM \"$child\"' USR1 USR2\n"
      "trap '[ -z \"$child\" ] || kill -TERM \"$child\"' TERM\n"
      "cd {} || exit 1\n"
      "if [ -e {} ]; then\n"
      "  (trap '' USR1 USR2; exec {}) &\n"
      "else\n"
      "  (trap '' USR1 USR2; exec {}) &\n"
      "fi\n"
      "child=$!\n"
      "while kill -0 \"$child\" 2>/dev/null; do wait \"$child\"; status=$?; done\n"
      "if [ -n \"$again\" ] && [ \"$status\" -eq 85 ]; then {}; fi\n"
      "exit \"$status\"\n",
      shell_quoted(std::filesystem::current_path().string()), shell_quoted(run + "/run.sqlite"),
      resume, evolve, requeue);
}

// What the job would find wrong, before it has waited in a queue for it.
Status check_job(std::vector<std::string> arguments) {
  arguments.emplace_back("--dry-run");
  ChildSetup setup;
  setup.arguments = std::move(arguments);
  ASSIGN_OR_RETURN(const Captured captured, run_captured(std::move(setup), "", kSubmitLimit_s));
  if (captured.succeeded()) return {};
  constexpr std::string_view kSelf = "gapfarm: ";
  std::string_view text = captured.err;
  if (text.starts_with(kSelf)) text.remove_prefix(kSelf.size());
  return Error{"the job would fail: " + std::string(text.substr(0, text.find('\n')))};
}

Result<int> run_submit(SubmitCommand command, CliContext& context) {
  if (command.evolve.empty() || command.evolve.front() != "evolve") {
    return Error{"submit needs -- evolve CONFIG --out RUN"};
  }
  RETURN_IF_ERROR(command.fleet.check());
  ASSIGN_OR_RETURN(const std::string run, run_of(&command.evolve));
  ASSIGN_OR_RETURN(const ClusterSite site, command.fleet.read_site());
  if (site.master.empty()) {
    return Error{site.system +
                 " has no row for a master as a job; run the master yourself, with --workers-on " +
                 site.system};
  }
  const std::string self = executable_path();
  std::vector<std::string> farm = {"--listen", command.listen};
  if (command.insecure)
    farm.insert(farm.end(), {"--insecure", "--insecure-anywhere"});
  else
    farm.insert(farm.end(), {"--keys", std::filesystem::absolute(command.keys).string()});
  append(farm, command.fleet.arguments("--workers-on"));
  std::vector<std::string> evolve = {self}, resume = {self, "resume", run};
  append(evolve, command.evolve);
  append(evolve, farm);
  append(resume, farm);
  const bool resumes = std::filesystem::exists(run + "/run.sqlite");
  RETURN_IF_ERROR(check_job(resumes ? resume : evolve));
  if (resumes)
    context.console.note(run + " holds a run: the job resumes it, and no config is read");
  const std::string script = master_script(run, quoted(evolve), quoted(resume), site.requeue);

  const std::string logs = std::filesystem::absolute(command.fleet.logs).string();
  const std::string name = "gf-" + std::filesystem::path(run).filename().string();
  SiteValues values = {{"name", {name}},
                       {"logs", {logs}},
                       {"notice", {std::to_string(command.notice_s)}},
                       {"cores", {"1"}},
                       {"wall", {}},
                       {"several", {}},
                       {"extra", command.fleet.extra}};
  if (!command.master_time.empty()) {
    ASSIGN_OR_RETURN(const double seconds, wall_time_s(command.master_time));
    values["wall"] = wall_arguments(site, seconds);
  }
  const std::vector<std::string> submit = expand(site.master, values);
  if (command.dry_run) {
    const std::string text = quoted(submit) + " <<'EOF'\n" + script + "EOF\n";
    context.console.result(text, {{"dry_run", true}, {"submission", text}});
    return kExitDone;
  }
  context.begun = true;
  RETURN_IF_ERROR(make_log_folder(logs));
  ChildSetup setup;
  setup.arguments = submit;
  ASSIGN_OR_RETURN(const Captured captured, run_captured(std::move(setup), script, kSubmitLimit_s));
  if (!captured.succeeded()) return Error{submit.front() + ": " + captured.err + captured.out};
  const std::string job = captured.out.substr(0, captured.out.find_first_of(" ;\n"));
  context.console.result(
      "job " + job + "; follow it with: gapfarm status " + shell_quoted(run) + " --watch\n",
      {{"job", job}, {"run", run}});
  return kExitDone;
}

}  // namespace

SubcommandRun setup_submit(CLI::App& app) {
  auto command = std::make_shared<SubmitCommand>();
  command->fleet.declare(app, "--on");
  app.add_option("--keys", command->keys, "Key folder, on a file system that all nodes see")
      ->type_name("FOLDER");
  app.add_flag("--insecure", command->insecure, "No keys, on every network");
  app.add_option("--listen", command->listen, "Where the master listens");
  app.add_option("--master-time", command->master_time,
                 "Wall time of the master's job: it is queued again and resumes the run")
      ->type_name("TIME");
  app.add_option("--notice", command->notice_s,
                 "Seconds before the end of it at which the master stops");
  app.add_flag("--dry-run", command->dry_run, "Print what would be submitted");
  app.add_option("EVOLVE", command->evolve, "After --: evolve CONFIG --out RUN ...")->required();
  app.footer(
      "Examples:\n"
      "  gapfarm submit --on slurm --max 200 --master-time 24:00:00 --wall-time 4:00:00 -- \\\n"
      "      evolve configs/demo.toml --out run/demo\n"
      "  gapfarm submit --on sge --max 20 --dry-run -- evolve configs/demo.toml --out run/demo");
  return [command](CliContext& context) { return run_submit(*command, context); };
}

}  // namespace gapfarm
