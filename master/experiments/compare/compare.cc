#include "master/experiments/compare/compare.h"

#include <map>
#include <memory>

#include "common/base/ranges.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {
namespace {

// So many generations in a row that ask nothing: every genome there is has been scored.
constexpr int kMostIdleGenerations = 1000;

class Lane {
 public:
  static Result<Lane> create(const Variant& variant, std::size_t index, std::uint64_t seed,
                             std::uint64_t evaluations) {
    EvolutionSettings settings = variant.config.evolution;
    settings.evaluations = settings.generations = evaluations;
    const OptimiserSetup setup = optimiser_setup(settings, variant.config.problem, seed);
    ASSIGN_OR_RETURN(const auto plan, read_stages(variant.config));
    Lane lane;
    ASSIGN_OR_RETURN(lane.optimiser_, under("variant \"" + variant.name + "\"",
                                            plan.stages.empty() ? make_optimiser(setup)
                                                                : make_staged(setup, plan.stages)));
    lane.kind_ = variant.config.problem.fitness.kind;
    lane.noisy_ = setup.noisy;
    lane.limit_ = evaluations;
    lane.run.variant = index;
    lane.run.seed = seed;
    return lane;
  }

  bool done() const { return run.evaluations >= limit_ || idle_ >= kMostIdleGenerations; }

  // Candidates of the next generation that asks for any.
  std::vector<Candidate> ask() {
    std::vector<Candidate> candidates = optimiser_->ask();
    while (candidates.empty() && idle_ < kMostIdleGenerations) {
      ++idle_;
      optimiser_->tell({});
      candidates = optimiser_->ask();
    }
    if (!candidates.empty()) idle_ = 0;
    return candidates;
  }

  void tell(std::span<const Score> scores) {
    for (std::size_t i = 0; i < scores.size() && !noisy_; ++i) {
      if (scores[i].outcome == v1::OK) improve(run.evaluations + i + 1, scores[i].cost);
    }
    optimiser_->tell(scores);
    run.evaluations += scores.size();
    // Under noise a single good score is luck: the optimiser says which is the best.
    const Individual& best = optimiser_->best();
    if (noisy_ && best.standing.outcome == v1::OK) {
      const double fitness = fitness_of_cost(kind_, best.standing.cost);
      if (run.improvements.empty() || run.improvements.back().fitness != fitness) {
        add(run.evaluations, fitness);
      }
    }
    run.evaluations = std::min(run.evaluations, limit_);
  }

  ComparedRun run;

 private:
  void improve(std::uint64_t evaluations, double cost) {
    if (run.improvements.empty() ||
        cost < cost_of_fitness(kind_, run.improvements.back().fitness)) {
      add(evaluations, fitness_of_cost(kind_, cost));
    }
  }
  void add(std::uint64_t evaluations, double fitness) {
    if (evaluations <= limit_) run.improvements.push_back({evaluations, fitness});
  }

  std::unique_ptr<Optimiser> optimiser_;
  FitnessKind kind_ = FitnessKind::kLogScore;
  bool noisy_ = false;
  std::uint64_t limit_ = 0;
  int idle_ = 0;
};

}  // namespace

Result<std::vector<ComparedRun>> compare(Farm& farm, std::span<const Variant> variants,
                                         const CompareOptions& options) {
  std::vector<Lane> lanes;
  std::vector<std::string> hashes;
  for (std::size_t v = 0; v < variants.size(); ++v) {
    hashes.push_back(farm.add_problem(to_proto(variants[v].config.problem)));
    for (unsigned s = 0; s < options.seeds; ++s) {
      ASSIGN_OR_RETURN(auto lane,
                       Lane::create(variants[v], v, options.first_seed + s, options.evaluations));
      lanes.push_back(std::move(lane));
    }
  }
  struct Round {
    std::vector<v1::Task> tasks;
    std::vector<std::size_t> lanes;  // of each
  };
  for (;;) {
    std::map<std::string, Round> rounds;  // by problem, which variants may share
    for (std::size_t i = 0; i < lanes.size(); ++i) {
      if (lanes[i].done()) continue;
      Round& round = rounds[hashes[lanes[i].run.variant]];
      for (const Candidate& candidate : lanes[i].ask()) {
        round.tasks.push_back(evaluation_task(candidate, lanes[i].run.seed));
        round.lanes.push_back(i);
      }
    }
    std::vector<std::vector<Score>> scores(lanes.size());
    for (const auto& [hash, round] : rounds) {
      if (round.tasks.empty()) continue;
      ASSIGN_OR_RETURN(const auto results, farm.run(hash, round.tasks));
      for (std::size_t k = 0; k < results.size(); ++k) {
        const std::size_t i = round.lanes[k];
        const Problem& problem = variants[lanes[i].run.variant].config.problem;
        ASSIGN_OR_RETURN(const Score score, score_of(results[k], problem.fitness));
        scores[i].push_back(score);
      }
    }
    if (std::ranges::all_of(scores, &std::vector<Score>::empty)) break;
    for (std::size_t i = 0; i < lanes.size(); ++i) {
      if (!scores[i].empty()) lanes[i].tell(scores[i]);
    }
  }
  return mapped(lanes, [](Lane& lane) { return std::move(lane.run); });
}

void name_apart(std::vector<Variant>& variants) {
  std::map<std::string, int> named, seen;
  for (const Variant& variant : variants) ++named[variant.name];
  for (Variant& variant : variants) {
    if (named[variant.name] > 1) variant.name = variant.config.path;
    const int times = ++seen[variant.name];
    if (times > 1) variant.name += " (" + std::to_string(times) + ")";
  }
}

}  // namespace gapfarm
