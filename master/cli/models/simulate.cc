// gapfarm simulate CONFIG|MODEL: make a trial log from a parameter set.
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/trials/read.h"
#include "master/cli/models/parameter_options.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"
#include "master/farm/planned_trials.h"

namespace gapfarm {
namespace {

struct SimulateOptions : LongOptions {
  std::string source;
  std::string like;
  std::vector<std::string> set;
  std::optional<std::uint64_t> seed;
  std::optional<unsigned> sessions, trials, chain;
  std::vector<double> levels, durations;
  std::vector<std::string> commands;
  std::optional<double> path_interval_s;
};

Status apply_options(const SimulateOptions& options, Config& config) {
  SimulateSettings& s = config.simulate;
  for (const std::string& setting : options.set) {
    RETURN_IF_ERROR(apply_setting(setting, config.problem));
  }
  if (options.seed) config.seed = *options.seed;
  if (options.sessions) s.sessions = *options.sessions;
  if (options.trials) s.trials_per_session = *options.trials;
  if (options.chain) s.chain = *options.chain;
  if (!options.levels.empty()) s.levels = options.levels;
  if (!options.durations.empty()) s.durations_s = options.durations;
  if (!options.commands.empty()) s.commands = options.commands;
  if (options.path_interval_s) s.path_interval_s = *options.path_interval_s;
  if (s.path_interval_s != 0 && s.path_interval_s < kLeastPathInterval_s) {
    return Error{"--paths is too fine, expected 0 (no paths) or at least 0.0001 s"};
  }
  const std::vector<std::string> known = command_names(config.problem.commands);
  for (const std::string& name : s.commands) {
    if (!contains(known, name)) {
      return Error{"unknown command '" + name + "'" + suggestion(name, known)};
    }
  }
  return {};
}

using Plan = std::vector<std::vector<v1::PlannedTrial>>;

// What is to be driven, and that its log can be written.  A plan that is drawn lies about the
// source's own origin; one of a log is where that was recorded.
Result<Plan> plan_and_outputs(SimulateOptions& options, const Source& source, CliContext& context) {
  const Config& config = source.config;
  Outputs& outputs = options.outputs;
  Plan plan;
  bool tips = false;
  if (options.like.empty()) {
    plan = draw_plan(config.problem, config.simulate, config.seed);
  } else {
    const std::vector<std::string> files = {options.like};
    ASSIGN_OR_RETURN(const TrialLog log,
                     read_trial_files(files, command_names(config.problem.commands)));
    show_notes(log, context.console);
    outputs.reads(log);
    tips = log.has_tips();
    plan = plan_of(config.problem, shifted(log, -source.frame_x_m, -source.frame_y_m));
  }
  outputs.reads(options.source);
  outputs.reads(source.config);
  if (options.out == "-") {
    if (context.console.json()) {
      return Error{"--json and --out - both want standard output; name a file"};
    }
    return plan;
  }
  const bool paths = config.simulate.path_interval_s > 0;
  tips = tips || !config.problem.pieces.empty();
  RETURN_IF_ERROR(outputs.plan(trial_file_names(options.out, paths, tips)));
  return plan;
}

Result<TrialLog> simulate(const SimulateOptions& options, const Source& source, const Plan& plan,
                          CliContext& context) {
  const Config& config = source.config;
  ASSIGN_OR_RETURN(const auto asked, options.begin("simulate", {{"drive sessions", 1, plan.size()}},
                                                   config.farm, context));
  context.work->stage(0);
  const std::string hash = asked->add_problem(to_proto(without_log(config.problem)));
  ASSIGN_OR_RETURN(
      const auto results,
      asked->run(hash, simulate_tasks(plan, {}, config.seed, config.simulate.path_interval_s)));
  ASSIGN_OR_RETURN(auto log, simulated_log(results, "the simulation",
                                           "; these parameters do not make a robot that drives"));
  return shifted(std::move(log), source.frame_x_m, source.frame_y_m);
}

Result<int> run_simulate(SimulateOptions& options, CliContext& context) {
  ASSIGN_OR_RETURN(Source source, read_source(options.source));
  RETURN_IF_ERROR(check_can(source.config.problem.scenario, kSimulates, options.source));
  RETURN_IF_ERROR(apply_options(options, source.config));
  ASSIGN_OR_RETURN(const Plan plan, plan_and_outputs(options, source, context));
  if (context.dry_run) {
    const auto trials = sum_of(plan, [](const auto& session) { return session.size(); });
    return print_dry_run("simulate " + std::to_string(trials) + " trials in " +
                             std::to_string(plan.size()) + " sessions into " + options.out +
                             ", seed " + std::to_string(source.config.seed),
                         {{"out", options.out}, {"trials", trials}, {"seed", source.config.seed}},
                         options.farm, source.config.farm, context);
  }
  ASSIGN_OR_RETURN(const TrialLog log, simulate(options, source, plan, context));
  if (options.out == "-") {
    context.console.print(format_trials(log));
    return kExitDone;
  }
  ASSIGN_OR_RETURN(const auto files, trial_files(log, options.out));
  for (const TrialFile& file : files) {
    RETURN_IF_ERROR(options.outputs.write(file.path, file.text));
  }
  context.console.result(options.out + ": " + std::to_string(log.trials.size()) +
                             " simulated trials, seed " + std::to_string(source.config.seed) + "\n",
                         {{"out", options.out},
                          {"trials", log.trials.size()},
                          {"paths", log.has_paths()},
                          {"seed", source.config.seed}});
  return kExitDone;
}

}  // namespace

SubcommandRun setup_simulate(CLI::App& app) {
  auto options = std::make_shared<SimulateOptions>();
  app.add_option("CONFIG|MODEL", options->source, "What to simulate")->required();
  app.add_option("--out", options->out, "Trial log to write; - for stdout")->required();
  app.add_option("--like", options->like, "Repeat the plan of this trial log");
  app.add_option("--set", options->set, "PARAMETER=VALUE, effects included; may repeat");
  app.add_option("--seed", options->seed, "Of plan and noise");
  app.add_option("--sessions", options->sessions, "Sessions")->check(CLI::Range(1, 10000));
  app.add_option("--trials", options->trials, "Trials a session")->check(CLI::Range(1, 100000));
  app.add_option("--chain", options->chain, "Trials between unrecorded moves")
      ->check(CLI::Range(1, 100000));
  app.add_option("--levels", options->levels, "Factors of the commands' duties")
      ->check(CLI::Range(0.001, 1.0));
  app.add_option("--durations", options->durations, "s")->check(CLI::Range(0.001, 60.0));
  app.add_option("--commands", options->commands, "Only these commands");
  app.add_option("--paths", options->path_interval_s, "s between samples of paths.csv; 0: none")
      ->check(CLI::Range(0.0, 10.0));
  options->declare(app, LongOptions::Leaves::kFile, false);
  app.footer(
      "Examples:\n"
      "  gapfarm simulate configs/srv1.toml --out trials.csv --sessions 3 --trials 100\n"
      "  gapfarm simulate run/demo/model.toml --out sag.csv --set battery_sag.rate=0.01\n"
      "  gapfarm simulate configs/srv1.toml --like logs/trials.csv --out again.csv --seed 2");
  return [options](CliContext& context) { return run_simulate(*options, context); };
}

}  // namespace gapfarm
