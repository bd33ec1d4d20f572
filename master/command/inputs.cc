#include "master/command/inputs.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <thread>

#include "common/base/build_info.h"
#include "common/trials/files.h"
#include "master/command/long_command.h"
#include "master/ground/diagnose_ground.h"
#include "master/store/run_reader.h"
#include "master/store/schema.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostFilesShown = 12;

LogLevel level_of(FarmEvent::Kind kind) {
  if (kind == FarmEvent::kQuarantined) return LogLevel::kError;
  const bool as_usual =
      kind == FarmEvent::kJoined || kind == FarmEvent::kReturned || kind == FarmEvent::kLeft;
  return as_usual ? LogLevel::kInfo : LogLevel::kWarn;
}

bool is_tcp(const std::string& endpoint) { return endpoint.rfind("tcp://", 0) == 0; }

// Where the farm listens, and how it is protected there.
Result<LinkSecurity> link_security(const FarmOptions& options,
                                   const std::vector<std::string>& endpoints) {
  LinkSecurity security;
  if (std::ranges::none_of(endpoints, is_tcp)) return security;
  if (!options.insecure) return master_security(options.keys);
  security.open = options.insecure_anywhere ? OpenLinks::kAnywhere : OpenLinks::kLoopback;
  return security;
}

std::vector<std::string> endpoints_of(const FarmOptions& options, const FarmSettings& settings) {
  if (options.listen.empty() && settings.listen) return {*settings.listen};
  return options.listen;
}

}  // namespace

Status read_log_of(const TrialOptions& trials, Config* config) {
  Problem& problem = config->problem;
  if (scenario_form(problem.scenario).objective) {
    if (trials.files.empty()) return {};
    return Error{config->path + ": scenario objective has no trials; omit --trials"};
  }
  RETURN_IF_ERROR(check_can(problem.scenario, kPredicts, config->path));
  if (!trials.files.empty()) config->trial_files = trials.files;
  if (config->trial_files.empty()) {
    return Error{config->path +
                 (problem.windows()
                      ? ": names no runs; add [runs] with folders = [\"FOLDER\"] or give --trials "
                        "FOLDER"
                      : ": names no trial files; add them to the config or give --trials FILE")};
  }
  if (problem.windows()) {
    return read_useful_runs(config->trial_files, config->windows, &problem);
  }
  ASSIGN_OR_RETURN(problem.log, read_trial_files(config->trial_files,
                                                 command_names(problem.commands), trials.read));
  return {};
}

Result<Config> read_config_and_trials(const std::string& config_path, const TrialOptions& trials) {
  ASSIGN_OR_RETURN(Config config, read_config(config_path));
  if (trials.needed) RETURN_IF_ERROR(check_moves(config.problem.scenario, config_path));
  RETURN_IF_ERROR(read_log_of(trials, &config));
  if (config.problem.log.files.empty()) return config;
  const v1::Problem message = to_proto(config.problem);
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
  static const std::map<std::string, LogFormat> kFormats = {{"text", LogFormat::kText},
                                                            {"json", LogFormat::kJson}};
  static const std::map<std::string, LogLevel> kLevels = {{"debug", LogLevel::kDebug},
                                                          {"info", LogLevel::kInfo},
                                                          {"warn", LogLevel::kWarn},
                                                          {"error", LogLevel::kError},
                                                          {"off", LogLevel::kOff}};
  app.add_option("--log-format", log_format, "Of what goes to stderr: text or json, a line each")
      ->transform(CLI::CheckedTransformer(kFormats).description(""))
      ->type_name("FORMAT");
  app.add_option("--log-level", log_level,
                 "debug (every job), info, warn, error or off (default: warn; info for json)")
      ->transform(CLI::CheckedTransformer(kLevels).description(""))
      ->type_name("LEVEL");
}

std::unique_ptr<Log> FarmOptions::open_log() const {
  LogOptions options;
  options.program = "gapfarm";
  options.format = log_format;
  options.level =
      log_level.value_or(log_format == LogFormat::kJson ? LogLevel::kInfo : LogLevel::kWarn);
  return std::make_unique<Log>(options);
}

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
  ASSIGN_OR_RETURN(base.security, link_security(options, base.listen));
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
  base.admittance.allow_mixed_numeric_classes = settings.allow_mixed_numeric_classes;
  base.stop = &context.stop;
  if (!base.on_event) report_to(context.console, base);
  return SocketFarm::create(std::move(base));
}

Result<std::unique_ptr<Farm>> start_recorded(const FarmOptions& options,
                                             const FarmSettings& settings, CliContext& context) {
  ASSIGN_OR_RETURN(auto farm, start_farm(options, settings, context));
  return context.work->over(std::move(farm));
}

Result<int> print_dry_run(const std::string& would, Json facts, const FarmOptions& options,
                          const FarmSettings& settings, CliContext& context) {
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

CLI::Option* TrialOptions::declare(CLI::App& app, const std::string& help) {
  CLI::Option* option = app.add_option("--trials", files, help)->type_name("FILE");
  declare_reading(app);
  return option;
}

void TrialOptions::declare_reading(CLI::App& app) {
  app.add_option("--paths", read.paths,
                 "Recorded paths of the trials, whatever they say of whose they are (default: a "
                 "paths.csv beside a log that says it belongs to it)")
      ->type_name("FILE");
  app.add_flag("--skip-invalid", read.skip_invalid,
               "Leave rows with mistakes out of the logs, and report which");
  app.add_flag("--session-prefix", read.name_sessions,
               "Put each log's file name before its sessions' names, for recorders that call them "
               "alike every day");
}

std::size_t count_sessions(const TrialLog& log) {
  std::set<std::string> sessions;
  for (const Trial& trial : log.trials) sessions.insert(trial.session);
  return sessions.size();
}

void show_notes(const TrialLog& log, Console& console) {
  for (const std::string& note : log.notes) console.note(note);
  if (log.files.empty()) return;
  const std::size_t shown = std::min(log.files.size(), kMostFilesShown);
  std::string text = "read " + joined(std::span(log.files).first(shown));
  if (log.files.size() > kMostFilesShown) {
    text += " and " + std::to_string(log.files.size() - kMostFilesShown) + " files more";
  }
  console.note(text);
}

std::vector<SanityFinding> log_warnings(const Problem& problem,
                                        const std::vector<std::string>& runs,
                                        std::vector<std::size_t>* impossible) {
  if (problem.ground) {
    const GroundRobot robot = problem.ground->robot_at(problem.values);
    const auto log = read_run_folders(runs, robot.channels);
    return log ? check_ground_log(robot, *log) : std::vector<SanityFinding>();
  }
  if (!problem.windows()) return check_sanity(problem, impossible);
  std::vector<SanityFinding> findings;
  check_count(problem.log, &findings);
  return findings;
}

void show_warnings(const Problem& problem, const std::vector<std::string>& runs, Console& console) {
  std::vector<std::size_t> impossible;
  for (const SanityFinding& f : log_warnings(problem, runs, &impossible)) {
    // Few trials are enough to tune by unless their poses are fewer numbers than the genes; notes
    // count where they are about rows.
    const bool enough = 3 * problem.log.trials.size() >= problem.genes.size();
    const bool note = f.severity == Severity::kNote && impossible.empty();
    if (note || (f.name == "too_few_trials" && enough)) continue;
    console.note(f.name + ": " + f.text + " " + f.remedy);
  }
}

Result<Model> find_model(const std::string& run_or_model, Console& console) {
  namespace fs = std::filesystem;
  const fs::path path(run_or_model);
  if (!is_folder(path)) return read_model(run_or_model);
  const fs::path file = path / "model.toml";
  std::optional<Model> left;
  if (is_there(file)) {
    ASSIGN_OR_RETURN(left, read_model(file.string()));
  }
  if (!is_there(run_store_file(path))) {
    if (left) return *std::move(left);
    return Error{run_or_model +
                 ": has neither a model.toml nor a run in it; give a model file or the folder of a "
                 "run or a diagnosis"};
  }
  ASSIGN_OR_RETURN(const RunReader run, RunReader::open(path));
  // A finished run that was resumed has gone on from what it left.
  ASSIGN_OR_RETURN(const auto generations, run.generations());
  const std::uint64_t reached = generations.empty() ? 0 : generations.back().generation;
  if (left && left->origin.generation >= reached) return *std::move(left);
  Result<Model> model = current_best(run);
  if (!model) return model;
  ASSIGN_OR_RETURN(const Progress progress, run.progress());
  console.note(
      run_or_model +
      (progress.state == RunState::kFinished
           ? ": this run is finished, but its model.toml is missing or old (gapfarm resume " +
                 shell_quoted(run_or_model) + " makes it again); taking its best, "
           : ": this run is not finished; taking its best so far, ") +
      run.info().fitness + " " + format_number(model->score) + " of generation " +
      std::to_string(model->origin.generation));
  return model;
}

Status check_same_robot(const Model& model, const std::string& path, const Config& config,
                        const std::string& config_path) {
  if (model.scenario == config.problem.scenario && model.robot_file == config.problem.robot_file) {
    return {};
  }
  return Error{path + ": is a model of another scenario or robot than " + config_path +
               "; give the config that it was made with"};
}

Status check_no_residual(const Model& model, const std::string& path, const std::string& user) {
  if (model.residual.empty()) return {};
  return Error{path +
               ": the model has a [residual], a correction of trials' ends by their places, "
               "headings and times, which " +
               user + " does not take along; leave that section out of a copy, or give tuned.toml"};
}

Result<Model> read_model_of(const std::string& run_or_model, Console& console) {
  ASSIGN_OR_RETURN(Model model, find_model(run_or_model, console));
  RETURN_IF_ERROR(check_can(model.scenario, kPredicts, run_or_model));
  return model;
}

void report_to(Log& log, SocketFarmOptions& options) {
  options.on_event = [&log](const FarmEvent& event) {
    std::vector<LogField> fields;
    if (!event.worker.empty()) fields.push_back({"worker", event.worker});
    if (!event.host.empty()) fields.push_back({"host", event.host});
    log.write(level_of(event.kind), event.text, fields);
  };
  if (!log.wants(LogLevel::kDebug)) return;
  options.on_job = [&log](const JobEvent& event) {
    log.write(LogLevel::kDebug, event.answered ? "job answered" : "job given out",
              {{"job", event.job},
               {"attempt", event.attempt},
               {"worker", event.worker},
               {"host", event.host}});
  };
}

void report_to(Console& console, SocketFarmOptions& options) {
  options.on_event = [&console](const FarmEvent& event) {
    const std::string text =
        (event.worker.empty() ? std::string() : "worker " + event.worker + ": ") + event.text;
    // Not what the command fails with: it may go on.
    if (level_of(event.kind) != LogLevel::kInfo) return console.note("gapfarm: " + text);
    if (console.kept() != nullptr) console.kept()->write(LogLevel::kInfo, text);
  };
}

Result<FittedRuns> open_fitted(const std::string& source, const std::vector<std::string>& folders,
                               Console& console) {
  if (!is_folder(source)) {
    ASSIGN_OR_RETURN(auto config, read_config_and_trials(source, {.files = folders, .read = {}}));
    return FittedRuns{config.problem, config.problem.values, config.windows, config.trial_files,
                      config.robot_path};
  }
  ASSIGN_OR_RETURN(const auto reader, RunReader::open(source));
  ASSIGN_OR_RETURN(auto problem, stored_problem(reader));
  ASSIGN_OR_RETURN(const auto model, read_model_of(source, console));
  ASSIGN_OR_RETURN(const auto config, parse_stored(reader.info(), problem));
  return FittedRuns{problem, model.values, {}, folders.empty() ? config.trial_files : folders};
}

}  // namespace gapfarm
