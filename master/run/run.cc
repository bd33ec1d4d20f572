#include "master/run/run.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/base/clock.h"
#include "common/base/ranges.h"
#include "common/trials/read.h"
#include "master/evolve/islands.h"
#include "master/evolve/optimisers.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/fit/simulated_start.h"
#include "master/run/run_page.h"

namespace gapfarm {
namespace {

// What a run begins with, read before any farm is there.
struct RunInputs {
  std::optional<Checkpoint> checkpoint;
  StagePlan plan;
  std::optional<Problem> held_out;
};

Result<RunInputs> read_inputs(const RunStore& store, const Config& config) {
  ASSIGN_OR_RETURN(auto checkpoint, store.checkpoint());
  ASSIGN_OR_RETURN(auto plan, read_stages(config));
  ASSIGN_OR_RETURN(auto held_out, read_validation(plan, config));
  return RunInputs{std::move(checkpoint), std::move(plan), std::move(held_out)};
}

// Where the search of a ground robot's values begins; nothing where the config has the say, and
// where there is no beginning.
Result<std::optional<SimulatedStart>> start_of(const RunInputs& inputs, const RunRequest& run,
                                               Farm& farm, RunWatcher& watcher) {
  const EvolutionSettings& settings = run.config.evolution;
  const bool own =
      !settings.seed_nominal || !inputs.plan.stages.empty() || !settings.start.genomes.empty();
  if (inputs.checkpoint || own || !run.problem.ground || run.problem.log.trials.empty()) {
    return std::optional<SimulatedStart>();
  }
  ASSIGN_OR_RETURN(auto start,
                   fit_by_simulation(farm, run.problem, run.config.evolution.optimiser.sigma));
  watcher.note(
      fmt::format("begins at least squares through the simulation: {} simulations from {} start{}, "
                  "{:.2f} nats a window more than with the values of the robot's own kinematics",
                  start.simulations, start.starts, start.starts == 1 ? "" : "s", start.gain));
  watcher.note(fmt::format(
      "on stretches held out of the fit the simulation predicts {:.2f} nats a window {} than the "
      "kinematics{}",
      std::abs(start.held_out_gain), start.held_out_gain < 0 ? "less" : "more",
      start.kinematic ? ", too little to leave the kinematics' values" : ""));
  return std::optional(std::move(start));
}

Result<std::unique_ptr<Optimiser>> optimiser_of(const RunInputs& inputs, const RunRequest& run,
                                                Farm& farm, RunWatcher& watcher) {
  ASSIGN_OR_RETURN(const auto start, start_of(inputs, run, farm, watcher));
  OptimiserSetup setup = optimiser_setup(run.config.evolution, run.problem, run.config.seed);
  if (start) {
    setup.nominal = start->genome;
    setup.spread = start->spread;
  }
  const std::vector<Stage>& stages = inputs.plan.stages;
  ASSIGN_OR_RETURN(auto made, stages.empty() ? make_optimiser(setup) : make_staged(setup, stages));
  if (inputs.checkpoint) RETURN_IF_ERROR(made->restore(inputs.checkpoint->optimiser_state));
  return made;
}

// What a run without a best to leave has to say.
std::string without_best(const EvolveSummary& evolved) {
  if (!evolved.best || evolved.best->standing.outcome == v1::OK) return {};
  if (evolved.best->standing.outcome != v1::INFEASIBLE) return "; no evaluation ended well";
  return fmt::format("; nothing feasible was found, violations sum to {:.6g} at least",
                     evolved.best->standing.cost);
}

Status write_end(RunStore& store, Progress progress, RunState state, const std::string& reason) {
  progress.state = state;
  progress.stop_reason = reason;
  progress.rate_per_s = 0;
  progress.time_left_s.reset();
  return store.set_progress(progress);
}

// How the run's results do on what was held out.
Result<std::vector<ScoreRow>> validated_by(const RunStore& store, const Problem& apart, Farm& farm,
                                           const Genome& best) {
  ASSIGN_OR_RETURN(const auto checkpoint, store.checkpoint());
  std::vector<Genome> stages;
  if (checkpoint) stages = stage_results(checkpoint->optimiser_state, apart.genes.size());
  return validate(farm, apart, stages, best);
}

// What a finished run is for: its model, held against trials held out and against no simulation.
Status leave_model(RunStore& store, const RunRequest& run, const RunInputs& inputs, Farm& farm,
                   RunWatcher& watcher, RunSummary& summary) {
  const Genome& best = summary.evolved.best->genome;
  if (inputs.held_out) {
    watcher.read(inputs.held_out->log);
    ASSIGN_OR_RETURN(auto validated, validated_by(store, *inputs.held_out, farm, best));
    summary.held_out = inputs.held_out->log.trials.size();
    summary.validated = std::move(validated);
  }
  RETURN_IF_ERROR(write_outputs(store, run.problem, run.config, summary.evolved, farm,
                                summary.validated, watcher));
  ASSIGN_OR_RETURN(const auto beside, baseline_note_of_run(run.problem, best, farm));
  if (!beside.empty()) watcher.note(beside);
  for (const std::string& name : output_files(run.problem))
    summary.files.push_back((store.run() / name).string());
  return {};
}

}  // namespace

Error stopped_by(RunStore& store, Error error, const Progress& last) {
  // Where even that cannot be written, status finds the master gone, and the error is reported.
  static_cast<void>(write_end(store, last, RunState::kStopped, error.message));
  return error;
}

Result<RunSummary> evolve_run(RunStore& store, const RunRequest& request, RunWatcher& watcher) {
  const auto inputs = read_inputs(store, request.config);
  if (!inputs) return stopped_by(store, inputs.error());
  const EvolveClock clock = monotonic_seconds;
  const double began_s = clock();
  FarmEventKeeper events(store, watcher);
  auto farm = request.open_farm([&](const FarmEvent& event) { events.keep(event); });
  if (!farm) return stopped_by(store, farm.error());
  auto optimiser = optimiser_of(*inputs, request, **farm, watcher);
  if (!optimiser) {
    events.flush();
    Progress last;
    last.farm = (*farm)->tally();
    return stopped_by(store, optimiser.error(), last);
  }
  std::string reason = (*optimiser)->reason();
  const OptimiserKind kind = request.config.evolution.optimiser.kind;
  if (reason.empty() && kind == OptimiserKind::kGenetic) {
    reason = default_optimiser(request.config.text).value_or(DefaultOptimiser{}).reason;
  }
  for (const std::string& note : {reason, unread_by_search(request.config.text, kind)}) {
    if (!note.empty()) watcher.note(note);
  }

  const double of_others_s = inputs->checkpoint ? inputs->checkpoint->wall_s : 0;
  FarmProgressWriter progress(store, **farm, request.config.evolution, inputs->checkpoint,
                              of_others_s + clock() - began_s, clock, watcher);
  progress.watch(&request.log, &events);
  const ScoreCandidates score = farm_scores(**farm, request.problem, request.config.seed, progress);
  StoreSink sink(store, request.problem, **farm, progress);
  EvolveOptions options;
  options.settings = request.config.evolution;
  options.fitness = request.problem.fitness.kind;
  options.spent_s = of_others_s;
  options.began_s = began_s;
  auto evolved = evolve(
      **optimiser, score, [&](const GenerationRecord& record) { return sink.commit(record); },
      clock, options, request.stop_requested);
  watcher.progress("", false);
  events.flush();
  if (!evolved) return stopped_by(store, evolved.error(), progress.now());
  RunSummary summary;
  summary.evolved = *std::move(evolved);
  summary.failure = progress.failure();
  summary.evolved.text += without_best(summary.evolved);
  const RunState state = summary.stopped() ? RunState::kStopped : RunState::kFinished;
  RETURN_IF_ERROR(write_end(store, progress.now(), state, summary.evolved.text));
  if (summary.stopped()) return summary;
  if (summary.evolved.best && summary.evolved.best->standing.outcome == v1::OK) {
    const Status left = leave_model(store, request, *inputs, **farm, watcher, summary);
    // Finished is what has its model; resumed, it only leaves that behind.
    if (!left) return stopped_by(store, left.error(), progress.now());
  }
  // Of earlier masters' generations too, and of what was done after the last one.
  ASSIGN_OR_RETURN(const auto given_up, store.quarantined());
  summary.given_up = given_up + (*farm)->given_up() - sink.quarantined();
  return summary;
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
  setup.genes = config.problem.genes;
  if (const auto islands = island_count(setup); !islands) {
    return Error{config.path + ": " + islands.error().message};
  }
  ASSIGN_OR_RETURN(const auto plan, read_stages(config));
  const auto log = read_validation(plan, config);
  return log ? Status() : Status(log.error());
}

Result<std::vector<ScoreRow>> validate(Farm& farm, const Problem& apart,
                                       const std::vector<Genome>& stages, const Genome& best) {
  std::vector<ScoreRow> rows = {{"the config's own values", {}}};
  std::vector<Genome> genomes = {{}};
  for (std::size_t i = 0; i < stages.size(); ++i) {
    rows.push_back({"after stage " + std::to_string(i + 1), {}});
    genomes.push_back(stages[i]);
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

namespace {

// Of trials that the model was fitted to.  A baseline has a handful of numbers a command: fitted to
// the trials that it is scored on it would look better than it is.
constexpr const char* kFromOthers =
    "learned from the other sessions or parts of the log (the model has seen all of it)";

bool same_trials(const TrialLog& a, const TrialLog& b) {
  const auto same = [](const Trial& s, const Trial& t) {
    return s.session == t.session && s.trial == t.trial && s.command == t.command &&
           s.X_WS.x == t.X_WS.x && s.X_WE.x == t.X_WE.x && s.X_WE.y == t.X_WE.y;
  };
  return std::equal(a.trials.begin(), a.trials.end(), b.trials.begin(), b.trials.end(), same);
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

}  // namespace

Result<std::string> baseline_note(const Model& model, const TrialLog& log,
                                  std::span<const double> scores) {
  if (!has_baselines(model.scenario) || log.trials.empty()) return std::string();
  const auto behind = trials_behind(model);
  if (behind && !same_trials(*behind, log)) {
    ASSIGN_OR_RETURN(const auto baselines, baseline_scores(*behind, log, model.commands));
    return note(compare_with_baselines(baselines, scores), "learned from the model's trials");
  }
  ASSIGN_OR_RETURN(const auto baselines,
                   crossfitted_baselines(log, model.commands, session_folds(log)));
  return note(compare_with_baselines(baselines, scores),
              behind ? kFromOthers : "learned from the other sessions of this log");
}

Result<std::string> baseline_note_of_run(const Problem& problem, const Genome& genome, Farm& farm) {
  if (!has_baselines(problem.scenario) || problem.log.trials.empty()) return std::string();
  ASSIGN_OR_RETURN(const auto results,
                   farm.run(farm.add_problem(to_proto(problem)), {prediction_task(genome, false)}));
  if (results.front().outcome() != v1::OK) return std::string();
  ASSIGN_OR_RETURN(const auto beside, baselines_beside(problem, results.front().predict()));
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
