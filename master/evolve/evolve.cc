#include "master/evolve/evolve.h"

#include <algorithm>
#include <sstream>
#include <unordered_map>

#include "common/base/ranges.h"
#include "master/ground/fit/kinematic_baseline.h"

namespace gapfarm {
namespace {

// Of so many when `done` of them took `wall_s`.
std::optional<double> at_this_pace(double left, double done, double wall_s) {
  if (done <= 0) return std::nullopt;
  return std::max(0.0, left) * wall_s / done;
}

template <class... Parts>
std::pair<StopReason, std::string> because(StopReason reason, const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return {reason, text.str()};
}

}  // namespace

std::optional<double> time_left_s(const EvolutionSettings& settings, const Pace& pace) {
  const auto generations =
      static_cast<double>(settings.generations) - static_cast<double>(pace.generation) - pace.share;
  std::optional<double> left = at_this_pace(
      generations, static_cast<double>(pace.generations_here) + pace.share, pace.wall_here_s);
  const auto sooner = [&](std::optional<double> other) {
    if (other) left = std::min(left.value_or(*other), *other);
  };
  if (settings.evaluations) {
    sooner(at_this_pace(
        static_cast<double>(*settings.evaluations) - static_cast<double>(pace.evaluations),
        static_cast<double>(pace.evaluations_here), pace.wall_here_s));
  }
  if (settings.time_s) sooner(std::max(0.0, *settings.time_s - pace.wall_s));
  return left;
}

OptimiserSetup optimiser_setup(const EvolutionSettings& settings, const Problem& problem,
                               std::uint64_t seed) {
  OptimiserSetup setup;
  setup.settings = settings;
  setup.table = &problem.table();
  setup.genes = problem.genes;
  setup.run_seed = seed;
  setup.noisy =
      problem.spread.kind == SpreadKind::kSampled && !compares_means(problem.fitness.kind);
  if (const SearchStart& start = settings.start; !start.genomes.empty()) {
    setup.settings.seed_nominal = true;
    setup.nominal = start.genomes.front();
    setup.given.assign(start.genomes.begin() + 1, start.genomes.end());
    return setup;
  }
  // Where kinematics show a value, no generation need look for it.
  setup.nominal =
      problem.genome_of(settings.seed_nominal ? kinematic_start(problem) : problem.values);
  return setup;
}

v1::Task evaluation_task(const Candidate& candidate, std::uint64_t run_seed) {
  v1::Task task;
  v1::EvaluateTask* evaluate = task.mutable_evaluate();
  evaluate->mutable_point()->mutable_genome()->Assign(candidate.genome.begin(),
                                                      candidate.genome.end());
  evaluate->mutable_stream()->set_run_seed(run_seed);
  evaluate->mutable_stream()->set_birth_id(candidate.birth_id);
  evaluate->mutable_stream()->set_replicate(candidate.replicate);
  return task;
}

Result<Score> score_of(const v1::TaskResult& result, const FitnessSettings& fitness) {
  if (result.outcome() == v1::INVALID_REQUEST) {
    return Error{"a worker refused the evaluation: " + result.message()};
  }
  if (result.outcome() == v1::INFEASIBLE) return Score{v1::INFEASIBLE, result.evaluate().penalty()};
  if (result.outcome() != v1::OK) return Score{result.outcome(), 0};
  const v1::EvaluateResult& answer = result.evaluate();
  Score score{v1::OK, cost_of_fitness(fitness.kind, answer.fitness())};
  const std::size_t objectives = fitness.objectives.size();
  if (static_cast<std::size_t>(answer.objectives_size()) != objectives) {
    return Error{"a worker answered " + std::to_string(answer.objectives_size()) +
                 " objectives of " + std::to_string(objectives)};
  }
  for (std::size_t i = 0; i < objectives; ++i) {
    const double value = answer.objectives(static_cast<int>(i));
    score.costs.push_back(fitness.objectives[i].maximise ? -value : value);
  }
  return score;
}

double cost_of_fitness(FitnessKind kind, double fitness) {
  return higher_is_better(kind) ? -fitness : fitness;
}

double fitness_of_cost(FitnessKind kind, double cost) {
  return higher_is_better(kind) ? -cost : cost;
}

namespace {

using Stop = std::pair<StopReason, std::string>;

constexpr std::uint64_t kMostAhead = 16;  // generations of an island

// The first condition that holds now, if any, with a sentence.
std::optional<Stop> reason_to_stop(const Optimiser& optimiser, const EvolveOptions& options,
                                   double wall_s, bool requested) {
  const EvolutionSettings& s = options.settings;
  const std::uint64_t generation = optimiser.generation();
  if (requested) {
    return because(StopReason::kRequested, "stopped by request after generation ", generation);
  }
  if (s.target_fitness && generation > 0 && optimiser.best().standing.outcome == v1::OK &&
      optimiser.best().standing.cost <= cost_of_fitness(options.fitness, *s.target_fitness)) {
    return because(StopReason::kTargetFitness, "reached a ", fitness_name(options.fitness), " of ",
                   fitness_of_cost(options.fitness, optimiser.best().standing.cost),
                   ", the target was ", *s.target_fitness);
  }
  if (generation >= s.generations) {
    return because(StopReason::kGenerations, "completed ", generation, " of ", s.generations,
                   " generations");
  }
  if (s.evaluations && optimiser.evaluations() >= *s.evaluations) {
    // A generation is always finished.
    return because(StopReason::kEvaluations, "used ", optimiser.evaluations(),
                   " evaluations, the limit was ", *s.evaluations);
  }
  if (s.time_s && generation > 0 && wall_s >= *s.time_s) {
    return because(StopReason::kTime, "used the ", *s.time_s, " s allowed");
  }
  const std::uint64_t idle = generation - optimiser.last_improvement();
  if (s.stagnation_generations && generation > 0 && idle >= *s.stagnation_generations) {
    return because(StopReason::kStagnation, "no improvement for ", idle, " generations");
  }
  return std::nullopt;
}

// Everything but the wall time.
GenerationRecord record_generation(const Optimiser& optimiser) {
  return {.generation = optimiser.generation(),
          .diversity = optimiser.diversity(),
          .operator_probabilities = optimiser.operator_probabilities(),
          .evaluations = optimiser.evaluations(),
          .members = optimiser.members(),
          .optimiser_state = optimiser.state()};
}

EvolveSummary summarise(const Optimiser& optimiser, const Stop& reason, double wall_s) {
  const auto best = optimiser.generation() > 0 ? std::optional(optimiser.best()) : std::nullopt;
  return {reason.first, reason.second, optimiser.generation(), optimiser.evaluations(),
          wall_s,       best};
}

// In the candidates' order.
Result<std::vector<Score>> scores_of(const ScoreCandidates& score_all,
                                     std::vector<Candidate> candidates) {
  const std::size_t asked = candidates.size();
  std::size_t got = 0;
  std::vector<Score> scores(asked);
  const auto take = [&](std::size_t place, const Score& score) {
    scores.at(place) = score;
    ++got;
    return Result<std::vector<Candidate>>(std::vector<Candidate>());
  };
  RETURN_IF_ERROR(score_all(std::move(candidates), take));
  if (got == asked) return scores;
  return Error{"asked for " + std::to_string(asked) + " scores, but got " + std::to_string(got)};
}

// Islands that go on one by one.
class IslandLoop {
 public:
  IslandLoop(Optimiser& optimiser, const KeepGeneration& keep, const EvolveOptions& options,
             std::function<double()> spent_s)
      : optimiser_(optimiser),
        islands_(*optimiser.islands()),
        keep_(keep),
        options_(options),
        spent_s_(std::move(spent_s)) {}

  // Begins what may begin and commits what is complete.  Error: keep()'s, or one of code kStopped
  // when stop() has something to say.
  Result<std::vector<Candidate>> go_on() {
    std::vector<Candidate> candidates;
    for (bool advanced = true; advanced;) {
      stop_ = reason_to_stop(optimiser_, options_, spent_s_(), false);
      if (stop_) return Error{stop_->second, ErrorCode::kStopped};
      for (Islands::Lot& lot : islands_.begin(last_worth_beginning())) {
        Lot& waited = lots_[lot.island];
        waited.missing = lot.candidates.size();
        waited.scores.resize(waited.missing);
        for (std::size_t i = 0; i < waited.missing; ++i) places_[next_place_++] = {lot.island, i};
        append(candidates, lot.candidates);
      }
      ASSIGN_OR_RETURN(advanced, commit_next());
    }
    return candidates;
  }

  Result<std::vector<Candidate>> take(std::size_t place, const Score& score) {
    const auto [island, index] = places_.extract(place).mapped();
    Lot& lot = lots_[island];
    lot.scores[index] = score;
    if (--lot.missing > 0) return std::vector<Candidate>();
    islands_.tell_island(island, lot.scores);
    return go_on();
  }

  const std::optional<Stop>& stop() const { return stop_; }

 private:
  struct Lot {
    std::size_t missing = 0;
    std::vector<Score> scores;
  };

  // No generation that the run cannot get to, if there were no duplicates.
  std::uint64_t last_worth_beginning() const {
    const EvolutionSettings& settings = options_.settings;
    std::uint64_t ahead = kMostAhead;
    if (settings.evaluations) {
      const std::uint64_t left = *settings.evaluations - optimiser_.evaluations();
      ahead = std::min(ahead, (left - 1) / islands_.population() + 1);
    }
    return std::min(optimiser_.generation() + ahead, settings.generations);
  }

  Result<bool> commit_next() {
    if (!islands_.advance()) return false;
    GenerationRecord record = record_generation(optimiser_);
    const double now_s = spent_s_();
    record.wall_s = now_s - committed_s_;
    committed_s_ = now_s;
    RETURN_IF_ERROR(keep_(record));
    return true;
  }

  Optimiser& optimiser_;
  Islands& islands_;
  const KeepGeneration& keep_;
  const EvolveOptions& options_;
  std::function<double()> spent_s_;
  double committed_s_ = options_.spent_s;
  std::unordered_map<std::size_t, Lot> lots_;                                    // by island
  std::unordered_map<std::size_t, std::pair<std::size_t, std::size_t>> places_;  // island, index
  std::size_t next_place_ = 0;
  std::optional<Stop> stop_;
};

}  // namespace

Result<EvolveSummary> evolve(Optimiser& optimiser, const ScoreCandidates& score,
                             const KeepGeneration& keep, const EvolveClock& clock,
                             const EvolveOptions& options,
                             const std::function<bool()>& stop_requested) {
  const double began_s = options.began_s.value_or(clock());
  const auto spent_s = [&] { return options.spent_s + clock() - began_s; };
  const auto requested = [&] { return stop_requested && stop_requested(); };

  if (optimiser.islands() != nullptr) {
    IslandLoop loop(optimiser, keep, options, spent_s);
    const auto run = [&]() -> Status {
      ASSIGN_OR_RETURN(auto first, loop.go_on());
      return score(std::move(first),
                   [&](std::size_t place, const Score& its) { return loop.take(place, its); });
    };
    const Status status = run();
    if (loop.stop()) return summarise(optimiser, *loop.stop(), spent_s());
    if (!requested()) return status.error();
    return summarise(optimiser, *reason_to_stop(optimiser, options, spent_s(), true), spent_s());
  }
  for (double committed_s = options.spent_s;;) {
    auto stop = reason_to_stop(optimiser, options, spent_s(), requested());
    if (stop) return summarise(optimiser, *stop, spent_s());

    const std::uint64_t generation = optimiser.generation();
    while (optimiser.generation() == generation) {
      const auto scores = scores_of(score, optimiser.ask());
      if (!scores && requested()) {
        stop = reason_to_stop(optimiser, options, spent_s(), true);
        return summarise(optimiser, *stop, spent_s());
      }
      if (!scores) return scores.error();
      optimiser.tell(*scores);
    }

    GenerationRecord record = record_generation(optimiser);
    record.wall_s = spent_s() - committed_s;
    committed_s += record.wall_s;
    RETURN_IF_ERROR(keep(record));
  }
}

}  // namespace gapfarm
