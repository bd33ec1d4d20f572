#include "master/cli/evolution/fleet_options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "common/base/build_info.h"
#include "common/base/hash.h"
#include "common/base/ranges.h"
#include "common/process/process_pool.h"
#include "common/trials/files.h"
#include "master/farm/local_workers.h"

namespace gapfarm {
namespace {

// A worker leaves so long before its job's time is up: closing takes a second, a task is not begun
// that would not be done; a quarter of what is short.
constexpr double kMostMargin_s = 30;
// Longer than the fleet takes at most to take its jobs away (FleetLoopOptions::drain_limit_s).
constexpr double kLeaveLimit_s = 90;

// Ten letters, which is what SGE shows of a name; the same for the same master and system, so that
// a fleet that died is taken over by the next.
std::string fleet_name(const std::string& endpoint, const std::string& system) {
  return "gf" + content_hash(endpoint + "|" + system).substr(0, 8);
}

std::vector<std::string> worker_command(const FleetChoice& choice, const ClusterSite& site,
                                        const std::string& program, const std::string& endpoint,
                                        const std::string& keys, bool insecure, double wall_s,
                                        double wait_limit_s) {
  std::vector<std::string> command = {program, "--connect", endpoint};
  if (insecure) {
    command.push_back("--insecure");
  } else {
    command.insert(command.end(), {"--keys", !choice.worker_keys.empty() ? choice.worker_keys
                                             : !site.keys.empty()        ? site.keys
                                                                         : whole_path(keys)});
  }
  if (choice.allow_external || site.allow_external) command.push_back("--allow-external");
  const auto seconds = [](double s) { return std::to_string(std::lround(s)); };
  command.insert(command.end(), {"--processes", std::to_string(choice.limits.workers_per_job),
                                 "--wait-limit", seconds(wait_limit_s)});
  if (wall_s > 0) {
    const double margin = std::min(kMostMargin_s, wall_s / 4);
    command.insert(command.end(), {"--lifetime", seconds(std::max(1.0, wall_s - margin))});
  }
  return command;
}

}  // namespace

void FleetChoice::declare(CLI::App& app, const std::string& with) {
  // Commands that have workers beside much else take them all and show the first alone.
  const bool alone = with == "--on";
  const std::string more = alone ? "" : " (`gapfarm workers --help`: their options)";
  CLI::Option* on = app.add_option(with, system,
                                   "Workers from slurm, sge, pbs, condor, kube, ssh or local: "
                                   "configs/sites has a file for each" +
                                       more)
                        ->type_name("SYSTEM");
  if (alone) on->required();
  if (!alone) app.option_defaults()->group("");
  const std::size_t others = static_cast<const CLI::App&>(app).get_options().size();
  app.add_option("--min", limits.min_workers, "Workers to keep also when there is little to do");
  app.add_option("--max", limits.max_workers, "Workers at most")->check(CLI::Range(1, 1000000));
  app.add_option("--site", site, "A site's own file in place of configs/sites/SYSTEM.toml")
      ->type_name("FILE");
  app.add_option("--workers-per-job", limits.workers_per_job,
                 "Worker processes, and cores, of a job")
      ->check(CLI::Range(1, 4096));
  app.add_option("--wall-time", wall_time, "Of each job: seconds, H:MM:SS or D-HH:MM:SS")
      ->type_name("TIME");
  app.add_option("--idle", limits.idle_s, "Workers that are not needed for so many seconds go")
      ->check(CLI::PositiveNumber);
  app.add_option("--look-every", look_interval_s, "Seconds between two looks at the cluster")
      ->check(CLI::PositiveNumber);
  app.add_option("--block", block, "Jobs in one submission at most (default: the site's)")
      ->check(CLI::Range(1, 100000));
  app.add_option("--with", extra,
                 "An option for the command that submits, --with=--partition=short; may repeat")
      ->type_name("OPTION");
  app.add_option("--host", hosts, "A host for workers (ssh); may repeat");
  app.add_option("--ssh-config", ssh_config, "For ssh -F")->type_name("FILE");
  app.add_option("--worker-program", worker, "gapfarm-worker as the nodes find it")
      ->type_name("FILE");
  app.add_option("--worker-keys", worker_keys, "Key folder as the nodes find it")
      ->type_name("FOLDER");
  app.add_flag("--allow-external", allow_external,
               "Let them start the programs that the master names (docs/security.md)");
  app.add_option("--worker-logs", logs, "Folder of the jobs' output, which all nodes see")
      ->type_name("FOLDER");
  app.option_defaults()->group("Options");
  options_ = static_cast<const CLI::App&>(app).get_options();
  options_.erase(options_.begin(), options_.begin() + static_cast<std::ptrdiff_t>(others));
}

std::vector<std::string> FleetChoice::arguments(const std::string& with) const {
  std::vector<std::string> all = {with, system};
  for (const CLI::Option* option : options_) {
    const std::string name = "--" + option->get_lnames().front();  // get_name() hides some
    const bool flag = option->get_items_expected_max() == 0;
    if (flag && option->count() > 0) all.push_back(name);
    // The value may begin as an option does.
    for (const std::string& value : option->results()) {
      if (!flag) all.push_back(name + "=" + value);
    }
  }
  return all;
}

Result<ClusterSite> FleetChoice::read_site() const {
  const std::string path = shipped_file(site.empty() ? "configs/sites/" + system + ".toml" : site);
  const Result<std::string> text = read_text_file(path);
  if (!text) {
    return Error{text.error().message +
                 "; systems are slurm, sge, pbs, condor, kube, ssh and local, and --site FILE "
                 "describes another"};
  }
  ASSIGN_OR_RETURN(ClusterSite read, parse_site(*text, path));
  if (!hosts.empty()) read.hosts = hosts;
  if (block > 0) read.block = block;
  if (look_interval_s > 0) read.interval_s = look_interval_s;
  if (read.jobs_per_host > 0 && read.hosts.empty()) {
    return Error{"no hosts for workers; name them with --host, or `hosts` in a --site file"};
  }
  return read;
}

Status FleetChoice::check() const {
  ASSIGN_OR_RETURN([[maybe_unused]] const ClusterSite read, read_site());
  if (limits.max_workers < std::max(limits.min_workers, limits.workers_per_job)) {
    return Error{"--max " + std::to_string(limits.max_workers) +
                 " is less than --min or than the " + std::to_string(limits.workers_per_job) +
                 " workers of one job; give --max N"};
  }
  if (!wall_time.empty()) {
    ASSIGN_OR_RETURN([[maybe_unused]] const double seconds, wall_time_s(wall_time));
  }
  return {};
}

Result<double> wall_time_s(const std::string& text) {
  const auto [before, after] = cut_at(text, '-');
  auto parts = parts_of(after ? *after : before, ':');
  if (after) parts.insert(parts.begin(), before);
  const bool whole = after ? parts.size() == 4 : parts.size() == 1 || parts.size() == 3;
  double sum = 0;
  bool numbers = true;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    unsigned value = 0;
    const char* end = parts[i].data() + parts[i].size();
    const auto [rest, error] = std::from_chars(parts[i].data(), end, value);
    numbers = numbers && error == std::errc() && rest == end;
    sum = sum * (i == 1 && after ? 24 : 60) + value;
  }
  if (whole && numbers && sum >= 1) return sum;
  return Error{"'" + text + "' is no wall time; give seconds, H:MM:SS or D-HH:MM:SS"};
}

Result<FleetLoopOptions> fleet_of(const FleetChoice& choice, const std::string& endpoint,
                                  const std::string& keys, bool insecure) {
  RETURN_IF_ERROR(choice.check());
  ASSIGN_OR_RETURN(ClusterSite site, choice.read_site());
  FleetLoopOptions options;
  options.endpoint = endpoint;
  if (insecure)
    options.security.open = OpenLinks::kAnywhere;
  else if (endpoint.rfind("tcp://", 0) == 0) {
    ASSIGN_OR_RETURN(options.security, worker_security(keys));
  }
  FleetOptions& fleet = options.fleet;
  if (!choice.wall_time.empty()) {
    ASSIGN_OR_RETURN(fleet.wall_time_s, wall_time_s(choice.wall_time));
  }
  std::string program = choice.worker.empty() ? site.worker : choice.worker;
  if (program.empty()) {
    ASSIGN_OR_RETURN(program, find_worker_program());
  }
  fleet.name = fleet_name(endpoint, site.system);
  fleet.worker = worker_command(choice, site, program, endpoint, keys, insecure, fleet.wall_time_s,
                                options.wait_limit_s);
  fleet.limits = choice.limits;
  fleet.limits.backoff_s = site.backoff_s;
  fleet.logs = whole_path(choice.logs);
  fleet.extra = choice.extra;
  if (!choice.ssh_config.empty()) fleet.ssh = {"-F", choice.ssh_config};
  fleet.site = std::move(site);
  return options;
}

Status make_log_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Error{"cannot make '" + folder + "' for logs: " + error.message()};
  return {};
}

Result<std::unique_ptr<OwnedChild>> start_workers_beside(const FleetChoice& choice,
                                                         const std::string& endpoint,
                                                         const std::string& keys, bool insecure) {
  ChildSetup setup;
  setup.arguments = {executable_path(), "workers", "--connect", endpoint};
  if (insecure)
    setup.arguments.push_back("--insecure");
  else
    setup.arguments.insert(setup.arguments.end(), {"--keys", keys});
  append(setup.arguments, choice.arguments("--on"));
  setup.death_signal = SIGTERM;
  setup.leads_group = true;  // Ctrl-C is for the command, which ends this when it is done
  ASSIGN_OR_RETURN(const pid_t pid, under("--workers-on " + choice.system, start_child(setup)));
  return std::make_unique<OwnedChild>(pid, kLeaveLimit_s);
}

}  // namespace gapfarm
