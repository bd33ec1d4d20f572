#include "master/run/run.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <tuple>

#include "common/base/ranges.h"
#include "common/trials/read.h"
#include "master/evolve/optimisers.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/fit/simulated_start.h"
#include "master/run/run_page.h"

namespace gapfarm {
namespace {

// Where the search of a ground robot's values begins; nothing where the config has the say, and
// where there is no beginning.
Status find_start(const RunRequest& run, Farm& farm, RunWatcher& watcher, OptimiserSetup* setup) {
  const EvolutionSettings& settings = run.config.evolution;
  if (!settings.seed_nominal || !settings.start.genomes.empty()) return {};
  if (!run.problem.ground || run.problem.log.trials.empty()) return {};
  ASSIGN_OR_RETURN(auto start, fit_by_simulation(farm, run.problem, settings.optimiser.sigma));
  watcher.note(
      fmt::format("begins at least squares through the simulation: {} simulations from {} start{}, "
                  "{:.2f} nats a window more than with the values of the robot's own kinematics",
                  start.simulations, start.starts, start.starts == 1 ? "" : "s", start.gain));
  watcher.note(fmt::format(
      "on stretches held out of the fit the simulation predicts {:.2f} nats a window {} than the "
      "kinematics{}",
      std::abs(start.held_out_gain), start.held_out_gain < 0 ? "less" : "more",
      start.kinematic ? ", too little to leave the kinematics' values" : ""));
  setup->nominal = std::move(start.genome);
  setup->spread = std::move(start.spread);
  return {};
}

// Of trials that the model was fitted to.  A baseline has a handful of numbers a command: fitted to
// the trials that it is scored on it would look better than it is.
constexpr const char* kFromOthers =
    "learned from the other sessions or parts of the log (the model has seen trials of it)";

bool share_trials(const TrialLog& a, const TrialLog& b) {
  const auto key = [](const Trial& t) {
    return std::tuple(t.command, t.X_WS.x, t.X_WE.x, t.X_WE.y);
  };
  const auto keys = mapped(a.trials, key);
  const std::set of_a(keys.begin(), keys.end());
  return std::ranges::any_of(b.trials, [&](const Trial& t) { return of_a.contains(key(t)); });
}

std::string note(const std::vector<BaselineComparison>& baselines, const std::string& how) {
  const std::string sentence = baseline_sentence(baselines, "the model");
  return sentence.empty() ? sentence : "without a simulation, " + how + ": " + sentence;
}

// Whether a scenario's commands can repeat, so that there is something to learn from repeats.
bool has_baselines(std::string_view scenario) {
  const ScenarioForm& form = scenario_form(scenario);
  return !form.pieces && form.commands().size() > 1;
}

// The trials that a model was fitted to, where its files are still at hand and hold as many.
std::optional<TrialLog> trials_behind(const Model& model) {
  std::error_code code;
  for (const std::string& file : model.data.files) {
    if (!std::filesystem::is_regular_file(file, code)) return std::nullopt;
  }
  if (model.data.files.empty()) return std::nullopt;
  auto log = read_trial_files(model.data.files, command_names(model.commands));
  if (!log || log->trials.size() != model.data.trials) return std::nullopt;
  return *std::move(log);
}

Result<std::unique_ptr<Optimiser>> make_search(const OptimiserSetup& setup,
                                               const std::vector<Stage>& stages) {
  return stages.empty() ? make_optimiser(setup) : make_staged(setup, stages);
}

}  // namespace

Result<std::unique_ptr<Optimiser>> optimiser_of(const RunRequest& run, const StagePlan& plan,
                                                const std::optional<Checkpoint>& checkpoint,
                                                Farm& farm, RunWatcher& watcher) {
  OptimiserSetup setup = optimiser_setup(run.config.evolution, run.problem, run.config.seed);
  const std::vector<Stage>& stages = plan.stages;
  if (!checkpoint && stages.empty()) RETURN_IF_ERROR(find_start(run, farm, watcher, &setup));
  ASSIGN_OR_RETURN(auto made, make_search(setup, stages));
  if (checkpoint) RETURN_IF_ERROR(made->restore(checkpoint->optimiser_state));
  std::string reason = made->reason();
  const OptimiserKind kind = run.config.evolution.optimiser.kind;
  if (reason.empty() && kind == OptimiserKind::kGenetic) {
    reason = default_optimiser(run.config.text).value_or(DefaultOptimiser{}).reason;
  }
  for (const std::string& note : {reason, unread_by_search(run.config.text, kind)}) {
    if (!note.empty()) watcher.note(note);
  }
  return made;
}

Result<std::optional<Problem>> read_validation(const StagePlan& plan, const Config& config) {
  if (plan.validation_files.empty()) return std::optional<Problem>();
  for (const std::string& file : plan.validation_files) {
    const auto same = [&](const std::string& other) {
      std::error_code code;
      return file == other || std::filesystem::equivalent(file, other, code);
    };
    if (std::ranges::any_of(config.trial_files, same)) {
      return Error{file + " is both evolved on and held out; a validation takes other trials"};
    }
  }
  Problem apart = config.problem;
  if (apart.windows()) {
    RETURN_IF_ERROR(read_useful_runs(plan.validation_files, config.windows, &apart));
    return std::optional<Problem>(std::move(apart));
  }
  ASSIGN_OR_RETURN(apart.log,
                   read_trial_files(plan.validation_files, command_names(config.problem.commands)));
  return std::optional<Problem>(std::move(apart));
}

// The search begins at the config's values; where something moves, kinematics give others.
Status check_values_in_range(const Config& config) {
  const Problem& problem = config.problem;
  if (!is_value(problem.fitness.kind) || !config.evolution.seed_nominal) return {};
  for (const Gene& gene : problem.genes) {
    const double value = problem.values[gene.row];
    if (value >= gene.lower && value <= gene.upper) continue;
    const auto text = [&](double v) { return problem.table().format(gene.row, v); };
    return Error{
        fmt::format("{}: {} is {}, outside of its range in [genes], {} to {}; widen the "
                    "range, give a value within it in [parameters], or set seed_nominal = "
                    "false in [evolution]",
                    config.path, problem.table()[gene.row].key, text(value), text(gene.lower),
                    text(gene.upper))};
  }
  return {};
}

Status check_runnable(const Config& config) {
  RETURN_IF_ERROR(check_evolvable(config));
  RETURN_IF_ERROR(check_values_in_range(config));
  OptimiserSetup setup;
  setup.settings = config.evolution;
  setup.table = &config.problem.table();
  setup.genes = config.problem.genes;
  ASSIGN_OR_RETURN(const auto plan, read_stages(config));
  RETURN_IF_ERROR(under(config.path, make_search(setup, plan.stages)));
  const auto log = read_validation(plan, config);
  return log ? Status() : Status(log.error());
}

Result<std::vector<ScoreRow>> validate(const RunStore& store, const Problem& apart, Farm& farm,
                                       const Genome& best) {
  ASSIGN_OR_RETURN(const auto checkpoint, store.checkpoint());
  std::vector<ScoreRow> rows = {{"the config's own values", {}}};
  std::vector<Genome> genomes = {{}};
  if (checkpoint) append(genomes, stage_results(checkpoint->optimiser_state, apart.genes.size()));
  for (std::size_t i = 1; i < genomes.size(); ++i) {
    rows.push_back({"after stage " + std::to_string(i), {}});
  }
  rows.push_back({"the best", {}});
  genomes.push_back(best);
  const auto task_of = [](const Genome& genome) { return evaluation_task({0, 0, genome}, 0); };
  ASSIGN_OR_RETURN(const auto results,
                   farm.run(farm.add_problem(to_proto(apart)), mapped(genomes, task_of)));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (results[i].outcome() == v1::OK) rows[i].score = results[i].evaluate().fitness();
  }
  return rows;
}

Result<std::string> baseline_note(const Model& model, const TrialLog& log,
                                  std::span<const double> scores) {
  if (!has_baselines(model.scenario) || log.trials.empty()) return std::string();
  const auto behind = trials_behind(model);
  // What has seen some of these trials predicts them the better for it.
  if (behind && !share_trials(*behind, log)) {
    ASSIGN_OR_RETURN(const auto baselines, baseline_scores(*behind, log, model.commands));
    return note(compare_with_baselines(baselines, scores), "learned from the model's trials");
  }
  ASSIGN_OR_RETURN(const auto baselines,
                   crossfitted_baselines(log, model.commands, session_folds(log)));
  return note(compare_with_baselines(baselines, scores),
              behind ? kFromOthers : "learned from the other sessions of this log");
}

std::string baseline_note_of_run(const std::vector<BaselineComparison>& beside) {
  return note(beside, kFromOthers);
}

Result<std::vector<BaselineComparison>> baselines_beside(const Problem& problem,
                                                         const v1::PredictResult& prediction) {
  if (!has_baselines(problem.scenario) || problem.log.trials.empty()) {
    return std::vector<BaselineComparison>();
  }
  const auto scores = mapped(prediction.predictions(), &v1::Predicted::log_score);
  ASSIGN_OR_RETURN(const auto baselines, crossfitted_baselines(problem.log, problem.commands,
                                                               session_folds(problem.log)));
  return compare_with_baselines(baselines, scores);
}

}  // namespace gapfarm
