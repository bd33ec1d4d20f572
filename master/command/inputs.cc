#include "master/command/inputs.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/base/shipped.h"
#include "common/base/try.h"
#include "common/config/config.h"
#include "common/problem/run_files.h"
#include "common/trials/files.h"
#include "common/trials/read.h"
#include "master/command/long_command.h"

namespace gapfarm {

Result<Config> read_config_and_trials(const std::string& config_path, const TrialOptions& trials) {
  Result<Config> config = read_config(config_path);
  if (!config) return config.error();
  if (trials.needed) {
    RETURN_IF_ERROR(check_moves(config->problem.scenario, config_path));
  }
  if (scenario_form(config->problem.scenario).objective) {
    if (trials.files.empty()) return config;
    return Error{config_path + ": scenario objective has no trials; omit --trials"};
  }
  if (!trials.files.empty()) config->trial_files = trials.files;
  if (config->trial_files.empty()) {
    const bool runs = config->problem.windows();
    return Error{config_path + (runs ? ": names no runs; add [runs] with folders = [\"FOLDER\"] or "
                                       "give --trials FOLDER"
                                     : ": names no trial files; add them to the config or give "
                                       "--trials FILE")};
  }
  if (config->problem.windows()) {
    const Status read = read_problem_runs(config->trial_files, config->windows, &config->problem);
    if (!read) return read.error();
    return config;
  }
  ASSIGN_OR_RETURN(
      TrialLog log,
      read_trial_files(config->trial_files, command_names(config->problem.commands), trials.read));
  config->problem.log = std::move(log);
  const v1::Problem message = to_proto(config->problem);
  ASSIGN_OR_RETURN(const Problem sound, from_proto(message));
  RETURN_IF_ERROR(check_sendable(message));
  return config;
}

Result<Source> read_source(const std::string& named) {
  const std::string path = shipped_file(named);
  ASSIGN_OR_RETURN(const std::string text, read_text_file(path));
  if (!is_model(text)) {
    ASSIGN_OR_RETURN(auto config, parse_config(text, path, start_program));
    RETURN_IF_ERROR(check_moves(config.problem.scenario, path));
    return Source{std::move(config)};
  }
  ASSIGN_OR_RETURN(const Model model, parse_model(text, path));
  RETURN_IF_ERROR(check_moves(model.scenario, path));
  Source source{{}, model.frame_x_m, model.frame_y_m};
  source.config.problem = problem_of(model);
  return source;
}

Result<Config> open_config(const std::string& config_path, const TrialOptions& trials,
                           Console& console, const std::function<Status(Config&)>& finish) {
  ASSIGN_OR_RETURN(Config config, read_config_and_trials(config_path, trials));
  RETURN_IF_ERROR(finish(config));
  show_notes(config.problem.log, console);
  return config;
}

void FarmOptions::declare(CLI::App& app, bool remote) {
  app.add_option("--workers", workers, "Local worker processes (default: one a core)")
      ->check(CLI::Range(0, 4096));
  if (!remote) return;
  app.add_option("--listen", listen, "Endpoint for remote workers, tcp://HOST:PORT; may repeat");
  app.add_option("--keys", keys, "Folder of the keys that tcp:// needs (`gapfarm keys --help`)")
      ->type_name("FOLDER");
  CLI::Option* open = app.add_flag(
      "--insecure", insecure,
      "Listen without keys: unencrypted, and open to whoever connects; on this machine only");
  app.add_flag("--insecure-anywhere", insecure_anywhere,
               "With --insecure: on every network that --listen names")
      ->needs(open);
  log.declare(app);
}

namespace {

bool is_tcp(const std::string& endpoint) { return endpoint.rfind("tcp://", 0) == 0; }

// Where the farm listens, and how it is protected there.
Result<LinkSecurity> link_security(const FarmOptions& options,
                                   const std::vector<std::string>& endpoints) {
  LinkSecurity security;
  if (std::none_of(endpoints.begin(), endpoints.end(), is_tcp)) return security;
  if (!options.insecure) return master_security(options.keys);
  security.open = options.insecure_anywhere ? OpenLinks::kAnywhere : OpenLinks::kLoopback;
  return security;
}

std::vector<std::string> endpoints_of(const FarmOptions& options, const FarmSettings& settings) {
  if (options.listen.empty() && settings.listen) return {*settings.listen};
  return options.listen;
}

}  // namespace

Status check_farm(const FarmOptions& options, const FarmSettings& settings) {
  const std::vector<std::string> endpoints = endpoints_of(options, settings);
  if (endpoints.empty() && local_workers(options, settings) == 0) {
    return Error{
        "--workers 0 leaves nobody to work; name an endpoint for remote ones with --listen"};
  }
  ASSIGN_OR_RETURN(const LinkSecurity security, link_security(options, endpoints));
  for (const std::string& endpoint : endpoints) {
    RETURN_IF_ERROR(may_listen(endpoint, security));
  }
  return {};
}

unsigned local_workers(const FarmOptions& options, const FarmSettings& settings) {
  if (options.workers >= 0) return static_cast<unsigned>(options.workers);
  return settings.workers.value_or(std::max(1u, std::thread::hardware_concurrency()));
}

Result<std::unique_ptr<SocketFarm>> start_farm(const FarmOptions& options,
                                               const FarmSettings& settings, CliContext& context,
                                               SocketFarmOptions base) {
  context.begun = true;
  base.local_workers = local_workers(options, settings);
  base.listen = endpoints_of(options, settings);
  ASSIGN_OR_RETURN(LinkSecurity security, link_security(options, base.listen));
  base.security = std::move(security);
  if (base.security.open != OpenLinks::kNever) {
    context.console.note(
        "insecure: links are neither encrypted nor authenticated; whoever reaches this machine's "
        "port gets jobs and may answer them falsely");
  }
  base.window = settings.window;
  base.heartbeat_interval_s = settings.heartbeat_interval_s;
  base.silence_limit_s = settings.silence_limit_s;
  base.local_limits = {settings.progress_limit_s, settings.answer_limit_s};
  base.job_limits = {settings.failure_limit, settings.kill_limit};
  base.copies.audit_share = settings.audit_share;
  base.copies.straggler_factor = settings.straggler_factor;
  base.allow_mixed_numeric_classes = settings.allow_mixed_numeric_classes;
  base.stop = &context.stop;
  if (!base.on_event) report_to(context.console, base);
  return SocketFarm::create(std::move(base));
}

Result<RecordedWork> start_recorded(const FarmOptions& options, const FarmSettings& settings,
                                    CliContext& context) {
  ASSIGN_OR_RETURN(auto farm, start_farm(options, settings, context));
  auto recorded = context.work->over(*farm);
  return RecordedWork{std::move(farm), std::move(recorded)};
}

Result<int> print_dry_run(const std::string& would, nlohmann::ordered_json facts,
                          const FarmOptions& options, const FarmSettings& settings,
                          CliContext& context) {
  RETURN_IF_ERROR(check_farm(options, settings));
  const unsigned workers = local_workers(options, settings);
  const std::vector<std::string> endpoints = endpoints_of(options, settings);
  std::string text = "dry run: nothing was simulated, started or written\nwould " + would +
                     "\nwould start " + std::to_string(workers) + " local workers";
  for (const std::string& endpoint : endpoints) text += " and listen at " + endpoint;
  facts["dry_run"] = true;
  facts["workers"] = workers;
  facts["listen"] = endpoints;
  context.console.result(text + "\n", facts);
  return kExitDone;
}

int failed(const Error& error, CliContext& context) {
  context.console.clear_progress();
  if (!context.begun) {
    context.console.error(error);
    return kExitBadUsage;
  }
  if (context.stop.requested()) {
    if (context.work == nullptr || !context.work->keeps()) {
      return kExitSignalBase + context.stop.signal();
    }
    context.console.note(context.work->how_to_go_on());
    return kExitResumable;
  }
  context.console.error(error);
  return kExitFailed;
}

}  // namespace gapfarm
