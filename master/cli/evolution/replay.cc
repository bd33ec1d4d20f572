// gapfarm replay RUN --genome ID: one individual of a run again, from what the run store keeps.
#include <spdlog/fmt/fmt.h>

#include <bit>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/json/fields.h"
#include "common/trials/read.h"
#include "common/trials/text/csv.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"
#include "master/evolve/evolve.h"
#include "master/evolve/individual.h"
#include "master/farm/planned_trials.h"
#include "master/run/stored_run.h"
#include "master/store/run_reader.h"

namespace gapfarm {
namespace {

struct ReplayOptions {
  std::string run;
  std::string genome;  // a birth id, or "best"
  std::optional<std::uint64_t> generation;
  std::string paths;
  std::string out;
  double interval_s = 0.05;
  Outputs outputs;
};

using Found = RunReader::Member;
using Individuals = std::vector<StoredIndividual>;

// Whom `choose` finds in the latest generation up to `until` that has one; none: it finds nobody.
template <class Choose>
Result<std::optional<Found>> latest(const RunReader& reader, std::optional<std::uint64_t> until,
                                    Choose choose) {
  ASSIGN_OR_RETURN(const auto generations, reader.generations());
  for (auto g = generations.rbegin(); g != generations.rend(); ++g) {
    if (until && g->generation > *until) continue;
    ASSIGN_OR_RETURN(const Individuals individuals, reader.individuals(g->generation));
    if (const StoredIndividual* one = choose(individuals)) {
      return std::optional(Found{g->generation, *one});
    }
  }
  return std::optional<Found>();
}

// Null: nobody ended well.
const StoredIndividual* first_that_ended_well(const Individuals& individuals) {
  return !individuals.empty() && individuals.front().fitness ? &individuals.front() : nullptr;
}

Result<Found> find(const RunReader& reader, const ReplayOptions& options) {
  const auto& until = options.generation;
  const std::string run = reader.run().string();
  ASSIGN_OR_RETURN(const auto generations, reader.generations());
  if (until && !generations.empty() &&
      (*until < generations.front().generation || *until > generations.back().generation)) {
    return Error{fmt::format("{}: --generation is {}, expected one of the run's, {} to {}", run,
                             *until, generations.front().generation,
                             generations.back().generation)};
  }
  if (options.genome == "best") {
    ASSIGN_OR_RETURN(auto best, latest(reader, until, first_that_ended_well));
    if (best) return *std::move(best);
    return Error{run + ": no generation holds an individual that ended well; evolve it further"};
  }
  const auto id = parse_integer(options.genome);
  if (!id || *id < 0) {
    return Error{"--genome is '" + options.genome + "', expected a birth id or 'best'"};
  }
  const auto birth_id = static_cast<std::uint64_t>(*id);
  ASSIGN_OR_RETURN(auto found, latest(reader, until, [&](const Individuals& all) {
                     return find_by(all, birth_id, &StoredIndividual::birth_id);
                   }));
  if (found) return *std::move(found);
  return Error{run + ": no generation" + (until ? " up to " + std::to_string(*until) : "") +
               " holds genome " + std::to_string(birth_id) +
               "; --genome best is its best, and `sqlite3 " + shell_quoted(run + "/run.sqlite") +
               " 'SELECT DISTINCT birth_id FROM individuals'` lists them"};
}

// A duplicate took its score from the first individual of that genome: who that is.
Result<std::optional<std::uint64_t>> earlier_twin(const RunReader& reader, const Found& found) {
  ASSIGN_OR_RETURN(const auto generations, reader.generations());
  std::optional<std::uint64_t> twin;
  for (const StoredGeneration& g : generations) {
    if (g.generation > found.generation) break;
    ASSIGN_OR_RETURN(const auto individuals, reader.individuals(g.generation));
    for (const StoredIndividual& other : individuals) {
      const bool earlier = other.birth_id < twin.value_or(found.individual.birth_id);
      if (earlier && other.genome == found.individual.genome) twin = other.birth_id;
    }
  }
  return twin;
}

// All scores of `individual`, on the random streams of `birth_id`.
Result<Standing> standing_of(Farm& farm, const Problem& problem, std::uint64_t seed,
                             const StoredIndividual& individual, std::uint64_t birth_id) {
  const auto tasks = mapped(indices(std::max(1u, individual.scores)), [&](std::size_t k) {
    return evaluation_task({birth_id, static_cast<unsigned>(k), individual.genome}, seed);
  });
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(problem)), tasks));
  Standing standing;
  for (const v1::TaskResult& result : results) {
    ASSIGN_OR_RETURN(const Score score, score_of(result, problem.fitness));
    standing.add(score);
  }
  return standing;
}

// Drives the whole log with this individual, pose by pose.
Result<TrialLog> drive(Farm& farm, const Problem& problem, std::uint64_t seed, const Genome& genome,
                       double interval_s) {
  auto tasks = simulate_tasks(plan_of(problem, problem.log), {}, seed, interval_s);
  for (v1::Task& task : tasks) {
    task.mutable_simulate()->mutable_point()->mutable_genome()->Assign(genome.begin(),
                                                                       genome.end());
  }
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(problem)), tasks));
  return simulated_log(results, "the drive");
}

std::string in_full(const std::string& outcome, const std::optional<double>& fitness) {
  return fitness ? format_number(fitness, 17) : outcome;
}

// Whether it is the same to the bit, in words and as JSON.
struct Comparison {
  bool same = false;
  std::string text;
  nlohmann::ordered_json json;
};

Comparison compare(const Found& found, const Standing& again, const Problem& problem) {
  const FitnessKind kind = problem.fitness.kind;
  const std::string outcome = v1::Outcome_Name(again.outcome);
  std::optional<double> fitness;
  if (again.outcome == v1::OK) fitness = fitness_of_cost(kind, again.cost);
  const StoredIndividual& stored = found.individual;
  Comparison result;
  result.same = outcome == stored.outcome && fitness.has_value() == stored.fitness.has_value() &&
                (!fitness || std::bit_cast<std::uint64_t>(*fitness) ==
                                 std::bit_cast<std::uint64_t>(*stored.fitness));
  const std::string now = in_full(outcome, fitness);
  result.text = fmt::format(
      "genome {} of generation {}: {} {}\n", stored.birth_id, found.generation, fitness_name(kind),
      result.same ? fmt::format("{} from {} scores, the same to the bit", now, again.scores)
                  : fmt::format("differs: stored {}, replayed {}",
                                in_full(stored.outcome, stored.fitness), now));
  result.json = {
      {"genome", stored.birth_id},
      {"generation", found.generation},
      {"fitness", fitness_name(kind)},
      {"same", result.same},
      {"stored", {{"outcome", stored.outcome}, {"fitness", number_or_null(stored.fitness)}}},
      {"replayed", {{"outcome", outcome}, {"fitness", number_or_null(fitness)}}},
      {"scores", again.scores}};
  return result;
}

Result<int> run_replay(ReplayOptions& options, CliContext& context) {
  ASSIGN_OR_RETURN(const RunReader reader, RunReader::open(options.run));
  const RunInfo& info = reader.info();
  ASSIGN_OR_RETURN(const Problem problem, stored_problem(reader));
  ASSIGN_OR_RETURN(const Found found, find(reader, options));

  ASSIGN_OR_RETURN(const Config config, stored_config(info, {}));
  options.outputs.reads(config);
  options.outputs.reads((std::filesystem::path(options.run) / "run.sqlite").string());
  RETURN_IF_ERROR(options.outputs.plan(options.paths));
  RETURN_IF_ERROR(options.outputs.plan(options.out));

  ASSIGN_OR_RETURN(auto farm, start_farm({.workers = 1}, {}, context));
  const auto scored_as = [&](std::uint64_t birth_id) {
    return standing_of(*farm, problem, info.seed, found.individual, birth_id);
  };
  ASSIGN_OR_RETURN(Standing again, scored_as(found.individual.birth_id));
  if (const auto twin = earlier_twin(reader, found); twin && *twin) {
    context.console.note("scored as its twin, genome " + std::to_string(**twin));
    ASSIGN_OR_RETURN(again, scored_as(**twin));
  }
  Comparison comparison = compare(found, again, problem);
  if (!comparison.same && farm->numeric_class() != info.numeric_class) {
    context.console.note("this machine computes other last bits: numeric class " +
                         farm->numeric_class() + ", the run's " + info.numeric_class);
  }
  if (!options.paths.empty()) {
    ASSIGN_OR_RETURN(const TrialLog log,
                     drive(*farm, problem, info.seed, found.individual.genome, options.interval_s));
    // Without a mark: they were not measured, so no log may read them by itself.
    RETURN_IF_ERROR(options.outputs.write(options.paths, format_paths(log)));
    comparison.text +=
        options.paths + ": " + std::to_string(log.trials.size()) + " trials driven by it\n";
    comparison.json["paths"] = options.paths;
  }
  if (!options.out.empty()) {
    ASSIGN_OR_RETURN(const Model model,
                     model_of_member(reader, found.individual, found.generation));
    RETURN_IF_ERROR(options.outputs.write(options.out, format_model(model)));
    comparison.text += options.out + ": its values, as a model\n";
    comparison.json["model"] = options.out;
  }
  context.console.result(comparison.text, comparison.json);
  return comparison.same ? kExitDone : kExitFailed;
}

}  // namespace

SubcommandRun setup_replay(CLI::App& app) {
  auto options = std::make_shared<ReplayOptions>();
  app.add_option("RUN", options->run, "Folder of the run")->required();
  app.add_option("--genome", options->genome, "Birth id of the individual, or best")->required();
  app.add_option("--generation", options->generation,
                 "As it was then (default: the last that holds it)");
  app.add_option("--paths", options->paths,
                 "Drive the run's log with it and write the poses on the way to this file");
  app.add_option("--interval", options->interval_s, "Between two poses, s")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--out", options->out, "Write its values to this file, a model");
  options->outputs.declare(app);
  app.footer(
      "Examples:\n"
      "  gapfarm replay run/demo --genome best --out best.toml\n"
      "  gapfarm replay run/demo --genome 1284 --paths driven_by_1284.csv --interval 0.02\n"
      "Exit status: 0 the same to the bit, 1 it differs (both values are shown).");
  return [options](CliContext& context) { return run_replay(*options, context); };
}

}  // namespace gapfarm
