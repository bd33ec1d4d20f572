// gapfarm replay RUN --genome ID: one individual of a run again, from what the run store keeps.
#include <bit>
#include <memory>

#include "common/trials/files.h"
#include "common/trials/write.h"
#include "master/cli/evolution_farm.h"
#include "master/cli/inputs.h"
#include "master/evolve/evaluation.h"
#include "master/evolve/individual.h"
#include "master/experiment/plan.h"
#include "master/store/run_reader.h"

namespace gapfarm {
namespace {

struct ReplayOptions {
  std::string run;
  std::uint64_t genome = 0;
  std::optional<std::uint64_t> generation;
  std::string paths;
  double interval_s = 0.05;
};

struct Found {
  StoredIndividual individual;
  std::uint64_t generation = 0;
};

// The individual as the latest generation up to `until` has it.
Result<Found> find_individual(const RunReader& reader, std::uint64_t birth_id,
                              std::optional<std::uint64_t> until) {
  const auto generations = reader.generations();
  if (!generations) return generations.error();
  for (auto g = generations->rbegin(); g != generations->rend(); ++g) {
    if (until && g->generation > *until) continue;
    const auto individuals = reader.individuals(g->generation);
    if (!individuals) return individuals.error();
    for (const StoredIndividual& individual : *individuals) {
      if (individual.birth_id == birth_id) return Found{individual, g->generation};
    }
  }
  return Error{reader.run().string() + ": no generation" +
               (until ? " up to " + std::to_string(*until) : "") + " holds genome " +
               std::to_string(birth_id) +
               "; `sqlite3 RUN/run.sqlite` lists them (docs/run_store.md)"};
}

// A duplicate took its score from the first individual of that genome: who that is.
Result<std::optional<std::uint64_t>> earlier_twin(const RunReader& reader, const Found& found) {
  const auto generations = reader.generations();
  if (!generations) return generations.error();
  std::optional<std::uint64_t> twin;
  for (const StoredGeneration& g : *generations) {
    if (g.generation > found.generation) break;
    const auto individuals = reader.individuals(g.generation);
    if (!individuals) return individuals.error();
    for (const StoredIndividual& other : *individuals) {
      const bool earlier = other.birth_id < twin.value_or(found.individual.birth_id);
      if (earlier && other.genome == found.individual.genome) twin = other.birth_id;
    }
  }
  return twin;
}

class Replay {
 public:
  Replay(SocketFarm& farm, const Problem& problem, std::uint64_t seed)
      : farm_(farm), problem_(problem), seed_(seed), hash_(farm.add_problem(to_proto(problem))) {}

  // All scores of `individual`, on the random streams of `birth_id`.
  Result<Standing> standing(const StoredIndividual& individual, std::uint64_t birth_id) {
    std::vector<v1::Task> tasks;
    for (unsigned replicate = 0; replicate < std::max(1u, individual.scores); ++replicate) {
      tasks.push_back(evaluation_task({birth_id, replicate, individual.genome}, seed_));
    }
    const auto results = farm_.run(hash_, tasks);
    if (!results) return results.error();
    Standing standing;
    for (const v1::TaskResult& result : *results) {
      const Result<Score> score = score_of(result, problem_.fitness.kind);
      if (!score) return score.error();
      standing.add(*score);
    }
    return standing;
  }

  // Drives the whole log with this individual, pose by pose.
  Result<TrialLog> drive(const StoredIndividual& individual, double interval_s) {
    std::vector<v1::Task> tasks =
        simulate_tasks(plan_of(problem_, problem_.log), {}, seed_, interval_s);
    for (v1::Task& task : tasks) {
      task.mutable_simulate()->mutable_point()->mutable_genome()->Assign(individual.genome.begin(),
                                                                         individual.genome.end());
    }
    const auto results = farm_.run(hash_, tasks);
    if (!results) return results.error();
    TrialLog log;
    for (const v1::TaskResult& result : *results) {
      if (result.outcome() != v1::OK) {
        return Error{"the drive ended with " + v1::Outcome_Name(result.outcome()) + " (" +
                     result.message() + ")"};
      }
      for (const v1::Trial& trial : result.simulate().trials()) {
        log.trials.push_back(from_proto(trial));
      }
    }
    return log;
  }

 private:
  SocketFarm& farm_;
  const Problem& problem_;
  std::uint64_t seed_;
  std::string hash_;
};

std::string in_full(const std::string& outcome, const std::optional<double>& fitness) {
  return fitness ? format_number(fitness, 17) : outcome;
}

// Says whether it is the same; true: to the bit.
bool compare(const Found& found, const Standing& again, const Problem& problem, Console& console) {
  const FitnessKind kind = problem.fitness.kind;
  const std::string outcome = v1::Outcome_Name(again.outcome);
  std::optional<double> fitness;
  if (again.outcome == v1::OK) fitness = fitness_of_cost(kind, again.cost);
  const StoredIndividual& stored = found.individual;
  const bool same = outcome == stored.outcome &&
                    fitness.has_value() == stored.fitness.has_value() &&
                    (!fitness || std::bit_cast<std::uint64_t>(*fitness) ==
                                     std::bit_cast<std::uint64_t>(*stored.fitness));
  const std::string who = "genome " + std::to_string(stored.birth_id) + " of generation " +
                          std::to_string(found.generation) + ": " + fitness_name(kind) + " ";
  if (same) {
    console.print(who + in_full(outcome, fitness) + " from " + std::to_string(again.scores) +
                  " scores, the same to the bit\n");
  } else {
    console.print(who + "differs: stored " + in_full(stored.outcome, stored.fitness) +
                  ", replayed " + in_full(outcome, fitness) + "\n");
  }
  return same;
}

Result<bool> replay(const ReplayOptions& options, CliContext& context) {
  const Result<RunReader> reader = RunReader::open(options.run);
  if (!reader) return reader.error();
  const RunInfo& info = reader->info();
  v1::Problem message;
  if (!message.ParseFromString(info.problem)) {
    return Error{options.run + ": the stored problem cannot be read; the run store is damaged"};
  }
  const Result<Problem> problem = from_proto(message);
  if (!problem) return problem.error();
  const Result<Found> found = find_individual(*reader, options.genome, options.generation);
  if (!found) return found.error();

  FarmOptions local;
  local.workers = 1;
  auto farm = start_farm(local, {}, context);
  if (!farm) return farm.error();
  Replay replay(**farm, *problem, info.seed);
  Result<Standing> again = replay.standing(found->individual, found->individual.birth_id);
  if (!again) return again.error();
  if (const auto twin = earlier_twin(*reader, *found); twin && *twin) {
    context.console.note("scored as its twin, genome " + std::to_string(**twin));
    again = replay.standing(found->individual, **twin);
    if (!again) return again.error();
  }
  const bool same = compare(*found, *again, *problem, context.console);
  if (!same && (*farm)->numeric_class() != info.numeric_class) {
    context.console.note("this machine computes other last bits: numeric class " +
                         (*farm)->numeric_class() + ", the run's " + info.numeric_class);
  }
  if (!options.paths.empty()) {
    const Result<TrialLog> log = replay.drive(found->individual, options.interval_s);
    if (!log) return log.error();
    if (Status s = write_file_atomically(options.paths, format_paths(*log)); !s) return s.error();
    context.console.note(options.paths + ": " + std::to_string(log->trials.size()) +
                         " trials driven by it");
  }
  return same;
}

int run_replay(const ReplayOptions& options, CliContext& context) {
  const Result<bool> same = replay(options, context);
  if (!same) return failed(same.error(), context);
  return *same ? kExitDone : kExitFailed;
}

}  // namespace

SubcommandRun setup_replay(CLI::App& app) {
  auto options = std::make_shared<ReplayOptions>();
  app.add_option("RUN", options->run, "Folder of the run")->required();
  app.add_option("--genome", options->genome, "Birth id of the individual")->required();
  app.add_option("--generation", options->generation,
                 "As it was then (default: the last that holds it)");
  app.add_option("--paths", options->paths,
                 "Drive the run's log with it and write the poses on the way (paths.csv)");
  app.add_option("--interval", options->interval_s, "Between two poses, s")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.footer(
      "Examples:\n"
      "  gapfarm replay run/demo --genome 1284\n"
      "  gapfarm replay run/demo --genome 1284 --paths paths.csv --interval 0.02\n"
      "Exit status: 0 the same to the bit, 1 it differs (both values are shown).");
  return [options](CliContext& context) { return run_replay(*options, context); };
}

}  // namespace gapfarm
