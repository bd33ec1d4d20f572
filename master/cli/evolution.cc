#include "master/cli/evolution.h"

#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/json/json.h"
#include "master/cli/baseline_notes.h"
#include "master/cli/evolution_farm.h"
#include "master/cli/leave_behind.h"
#include "master/cli/validation.h"
#include "master/evolve/evaluation.h"
#include "master/evolve/evolve.h"
#include "master/evolve/optimisers.h"
#include "master/evolve/staged.h"
#include "master/ground/simulated_start.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

class SteadyClock : public EvolveClock {
 public:
  double now_s() const override { return steady_now_s(); }
};

Result<std::unique_ptr<Optimiser>> optimiser_at(const std::optional<Checkpoint>& checkpoint,
                                                const EvolutionRun& run, const StagePlan& plan,
                                                const std::optional<SimulatedStart>& start) {
  OptimiserSetup setup = optimiser_setup(run.config.evolution, run.problem, run.config.seed);
  if (start) {
    setup.nominal = start->genome;
    setup.spread = start->spread;
  }
  if (!plan.stages.empty()) {
    return checkpoint ? restore_staged(setup, plan.stages, checkpoint->optimiser_state)
                      : make_staged(setup, plan.stages);
  }
  return checkpoint ? restore_optimiser(setup, checkpoint->optimiser_state) : make_optimiser(setup);
}

// Where the search of a ground robot's values begins; nothing where the config has the say, and
// where there is no beginning.
Result<std::optional<SimulatedStart>> start_of(const std::optional<Checkpoint>& checkpoint,
                                               const EvolutionRun& run, const StagePlan& plan,
                                               Farm& farm, Console& console) {
  const bool own = !run.config.evolution.seed_nominal || !plan.stages.empty();
  if (checkpoint || own || !run.problem.ground || run.problem.log.trials.empty()) {
    return std::optional<SimulatedStart>();
  }
  auto start = fit_by_simulation(farm, run.problem, run.config.evolution.optimiser.sigma);
  if (!start) return start.error();
  console.note(fmt::format(
      "begins at least squares through the simulation: {} simulations from {} start{}, {:.2f} nats "
      "a window more than with the values of the robot's own kinematics",
      start->simulations, start->starts, start->starts == 1 ? "" : "s", start->gain));
  console.note(fmt::format(
      "on stretches left out of the fit the simulation foretells {:.2f} nats a window {} than the "
      "kinematics{}; no median error there is more than {:.2f} times theirs",
      std::abs(start->left_out_gain), start->left_out_gain < 0 ? "less" : "more",
      start->kinematic ? ", and the kinematics' values are kept" : "", start->worst_ratio));
  return std::optional(*std::move(start));
}

// How the run's results do on the trials that were kept apart; added to the text and the JSON, too.
Result<std::vector<Validated>> add_validation(RunStore& store, const EvolutionRun& run,
                                              const Problem& apart, Farm& farm, const Genome& best,
                                              std::string& text, Json& json) {
  const auto checkpoint = store.checkpoint();
  if (!checkpoint) return checkpoint.error();
  std::vector<Genome> stages;
  if (*checkpoint) {
    stages = stage_results((*checkpoint)->optimiser_state, run.problem.genes.size());
  }
  auto rows = validate(farm, apart, stages, best);
  if (!rows) return rows.error();
  text += fmt::format("validation on {} {} kept apart, {}:\n", apart.log.trials.size(),
                      apart.ground ? "windows" : "trials", fitness_name(run.problem.fitness.kind));
  for (const Validated& row : *rows) {
    text += fmt::format("  {:<24} {}\n", row.name,
                        row.fitness ? fmt::format("{:.6g}", *row.fitness) : "does not end well");
    json["validation"].push_back(
        {{"name", row.name}, {"fitness", row.fitness ? Json(*row.fitness) : Json()}});
  }
  return rows;
}

Status write_end(RunStore& store, const FarmProgressWriter& writer, RunState state,
                 const std::string& reason) {
  Progress progress = writer.now();
  progress.state = state;
  progress.stop_reason = reason;
  progress.rate_per_s = 0;
  progress.time_left_s.reset();
  return store.set_progress(progress);
}

Status conclude(RunStore& store, const EvolveSummary& summary, const FarmProgressWriter& writer) {
  const bool requested = summary.reason == StopReason::kRequested;
  return write_end(store, writer, requested ? RunState::kStopped : RunState::kFinished,
                   summary.text);
}

std::string outcome_line(const EvolutionRun& run, const EvolveSummary& summary) {
  std::string text = summary.text;
  if (summary.best && summary.best->outcome == v1::OK) {
    text += fmt::format("; best {} {:.6g}", fitness_name(run.problem.fitness.kind),
                        fitness_of_cost(run.problem.fitness.kind, summary.best->cost));
  }
  return text + fmt::format(" after {} generations, {} evaluations, {}", summary.generations,
                            summary.evaluations, format_duration(summary.wall_s));
}

Json outcome_json(const RunStore& store, const EvolutionRun& run, const EvolveSummary& summary) {
  const FitnessKind kind = run.problem.fitness.kind;
  Json json = {{"run", store.run().string()},
               {"state", summary.reason == StopReason::kRequested ? "stopped" : "finished"},
               {"stop_reason", summary.text},
               {"generations", summary.generations},
               {"evaluations", summary.evaluations},
               {"wall_s", summary.wall_s},
               {"fitness", fitness_name(kind)},
               {"best_fitness", nullptr}};
  if (summary.best && summary.best->outcome == v1::OK) {
    json["best_fitness"] = fitness_of_cost(kind, summary.best->cost);
  }
  return json;
}

Result<std::unique_ptr<SocketFarm>> start_farm_of(const RunStore& store, const EvolutionRun& run,
                                                  FarmEventKeeper& events, CliContext& context) {
  SocketFarmOptions base;
  base.epoch = store.epoch();
  base.numeric_class = store.info().numeric_class;
  base.shuffle_seed = run.shuffle_seed;
  report_to(run.log, base);
  events.listen(base);
  auto farm = start_farm(run.farm, run.config.farm, context, base);
  if (!farm) return farm;
  for (const std::string& endpoint : (*farm)->endpoints()) {
    if (endpoint.rfind("ipc://", 0) != 0) {
      context.console.note("listening for workers: gapfarm-worker --connect " + endpoint);
    }
  }
  return farm;
}

// What a finished run is for: its model, held against trials kept apart and against no simulation.
Status leave_model(RunStore& store, const EvolutionRun& run,
                   const std::optional<Problem>& kept_apart, const EvolveSummary& summary,
                   Farm& farm, CliContext& context, std::string& text, Json& json) {
  std::vector<Validated> validated;
  if (kept_apart) {
    show_notes(kept_apart->log, context.console);
    auto added = add_validation(store, run, *kept_apart, farm, summary.best->genome, text, json);
    if (!added) return added.error();
    validated = std::move(*added);
  }
  const Status left = leave_behind(store, run.problem, run.config, summary, farm, validated);
  if (!left) return left;
  const auto beside = baseline_note_of_run(run.problem, summary.best->genome, farm);
  if (!beside) return beside.error();
  if (!beside->empty()) context.console.note(*beside);
  const char* separator = "left behind: ";
  for (const char* name : {"model.toml", "report.html", "poses.svg", "fitness.svg"}) {
    text += separator + (store.run() / name).string();
    json["files"].push_back((store.run() / name).string());
    separator = ", ";
  }
  text += "\n";
  return {};
}

}  // namespace

void EvolutionOverrides::declare(CLI::App& app) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
  app.add_option("--generations", generations, "Stop after so many generations")
      ->check(CLI::Range(std::uint64_t{1}, kMost));
  app.add_option("--evaluations", evaluations,
                 "Stop after the generation in which so many evaluations are reached")
      ->check(CLI::Range(std::uint64_t{1}, kMost));
  app.add_option("--time", time_s, "Stop after so many seconds")->check(CLI::PositiveNumber);
  app.add_option("--target", target_fitness, "Stop at this fitness");
  app.add_option("--population", population, "Individuals")->check(CLI::Range(2, 1000000));
}

void EvolutionOverrides::apply(EvolutionSettings& settings) const {
  if (generations) settings.generations = *generations;
  if (evaluations) settings.evaluations = *evaluations;
  if (time_s) settings.time_s = *time_s;
  if (target_fitness) settings.target_fitness = *target_fitness;
  if (population) settings.population = *population;
  if (population) settings.optimiser.population = *population;
}

void EvolutionOverrides::merge(const EvolutionOverrides& later) {
  if (later.generations) generations = later.generations;
  if (later.evaluations) evaluations = later.evaluations;
  if (later.time_s) time_s = later.time_s;
  if (later.target_fitness) target_fitness = later.target_fitness;
  if (later.population) population = later.population;
}

std::string EvolutionOverrides::to_json() const {
  Json json = Json::object();
  if (generations) json["generations"] = *generations;
  if (evaluations) json["evaluations"] = *evaluations;
  if (time_s) json["time_s"] = *time_s;
  if (target_fitness) json["target_fitness"] = *target_fitness;
  if (population) json["population"] = *population;
  return json_text(json);
}

EvolutionOverrides EvolutionOverrides::from_json(const std::string& text) {
  EvolutionOverrides overrides;
  const Json json = parse_json(text);
  if (!json.is_object()) return overrides;
  const auto read = [&](const char* key, auto& to) {
    using Value = typename std::decay_t<decltype(to)>::value_type;
    if (json.contains(key) && json[key].is_number()) to = json[key].get<Value>();
  };
  read("generations", overrides.generations);
  read("evaluations", overrides.evaluations);
  read("time_s", overrides.time_s);
  read("target_fitness", overrides.target_fitness);
  read("population", overrides.population);
  return overrides;
}

int run_evolution(RunStore& store, const EvolutionRun& run, CliContext& context) {
  run.log.set({"run", store.run().string()});
  // Without it the run goes on all the same.
  if (Status s = context.console.keep((store.run() / "log.txt").string()); !s) {
    context.console.error(s.error());
  }
  run.log.copy_to(context.console.kept());
  const auto checkpoint = store.checkpoint();
  if (!checkpoint) return failed(checkpoint.error(), context);
  const auto plan = read_stages(run.config);
  if (!plan) return failed(plan.error(), context);
  const auto kept_apart = read_validation(*plan, run.config);
  if (!kept_apart) return failed(kept_apart.error(), context);
  const auto page = open_page(run.page, store.run(), context);
  if (!page) return failed(page.error(), context);
  FarmEventKeeper events(store, context.console);
  auto farm = start_farm_of(store, run, events, context);
  if (!farm) return failed(farm.error(), context);

  const auto start = start_of(*checkpoint, run, *plan, **farm, context.console);
  if (!start) return failed(start.error(), context);
  auto optimiser = optimiser_at(*checkpoint, run, *plan, *start);
  if (!optimiser) return failed(optimiser.error(), context);

  const SteadyClock clock;
  FarmProgressWriter progress(store, **farm, run.config.evolution, *checkpoint, clock,
                              context.console);
  progress.watch(&run.log, &events);
  FarmBackend backend(**farm, run.problem, run.config.seed, progress);
  StoreSink sink(store, run.problem, **farm, progress);
  EvolveOptions options;
  options.settings = run.config.evolution;
  options.fitness = run.problem.fitness.kind;
  if (*checkpoint) options.spent_s = (*checkpoint)->wall_s;
  const auto summary =
      evolve(**optimiser, backend, sink, clock, options, [&] { return context.stop.requested(); });
  context.console.clear_progress();
  events.flush();
  if (!summary) {
    // Where even that cannot be written, status finds the master gone, and the error is on stderr.
    static_cast<void>(write_end(store, progress, RunState::kStopped, summary.error().message));
    return failed(summary.error(), context);
  }
  if (Status s = conclude(store, *summary, progress); !s) return failed(s.error(), context);
  std::string text = outcome_line(run, *summary) + "\n";
  Json json = outcome_json(store, run, *summary);
  if (summary->reason == StopReason::kRequested) {
    context.console.result(text, json);
    context.console.note("continue with: gapfarm resume " + store.run().string());
    return kExitResumable;
  }
  if (summary->best && summary->best->outcome == v1::OK) {
    const Status left = leave_model(store, run, *kept_apart, *summary, **farm, context, text, json);
    if (!left) return failed(left.error(), context);
  }
  // Of earlier masters' generations too, and of what was done after the last one.
  const auto given_up = store.quarantined();
  if (!given_up) return failed(given_up.error(), context);
  const std::uint64_t lost = *given_up + (*farm)->counts().quarantined - sink.quarantined();
  json["given_up"] = lost;
  context.console.result(text, json);
  if (lost == 0) return kExitDone;
  context.console.note(fmt::format("{} given up; which and why: gapfarm status {}",
                                   lost == 1 ? "1 task was" : std::to_string(lost) + " tasks were",
                                   store.run().string()));
  return kExitQuarantined;
}

}  // namespace gapfarm
