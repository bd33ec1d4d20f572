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

Result<std::vector<ComparedRun>> compare(std::span<const Variant> variants,
                                         const CompareOptions& options,
                                         const CompareScorer& scorer) {
  std::vector<Lane> lanes;
  for (std::size_t v = 0; v < variants.size(); ++v) {
    for (unsigned s = 0; s < options.seeds; ++s) {
      ASSIGN_OR_RETURN(auto lane,
                       Lane::create(variants[v], v, options.first_seed + s, options.evaluations));
      lanes.push_back(std::move(lane));
    }
  }
  for (;;) {
    std::vector<CompareRequest> requests;
    std::vector<std::size_t> asked(lanes.size());  // requests a lane
    for (std::size_t i = 0; i < lanes.size(); ++i) {
      if (lanes[i].done()) continue;
      const std::vector<Candidate> candidates = lanes[i].ask();
      for (const Candidate& candidate : candidates) {
        requests.push_back({lanes[i].run.variant, lanes[i].run.seed, candidate});
      }
      asked[i] = candidates.size();
    }
    if (requests.empty()) break;
    ASSIGN_OR_RETURN(const auto scores, scorer(requests));
    if (scores.size() != requests.size()) {
      return Error{"asked for " + std::to_string(requests.size()) + " scores, but got " +
                   std::to_string(scores.size())};
    }
    std::span<const Score> rest = scores;
    for (std::size_t i = 0; i < lanes.size(); ++i) {
      if (asked[i] > 0) lanes[i].tell(rest.first(asked[i]));
      rest = rest.subspan(asked[i]);
    }
  }
  return mapped(lanes, [](Lane& lane) { return std::move(lane.run); });
}

CompareScorer farm_scorer(Farm& farm, std::span<const Variant> variants) {
  const auto hashes = mapped(variants, [&](const Variant& variant) {
    return farm.add_problem(to_proto(variant.config.problem));
  });
  const auto fitness = mapped(variants, [](auto& v) { return v.config.problem.fitness; });
  return [&farm, hashes,
          fitness](std::span<const CompareRequest> requests) -> Result<std::vector<Score>> {
    std::map<std::string, std::vector<std::size_t>> by_problem;
    for (std::size_t i = 0; i < requests.size(); ++i) {
      by_problem[hashes[requests[i].variant]].push_back(i);
    }
    std::vector<Score> scores(requests.size());
    for (const auto& [hash, members] : by_problem) {
      std::vector<v1::Task> tasks = mapped(members, [&](const std::size_t i) {
        return evaluation_task(requests[i].candidate, requests[i].seed);
      });
      ASSIGN_OR_RETURN(const auto results, farm.run(hash, tasks));
      const FitnessSettings& settings = fitness[requests[members.front()].variant];
      for (std::size_t k = 0; k < members.size(); ++k) {
        ASSIGN_OR_RETURN(scores[members[k]], score_of(results[k], settings));
      }
    }
    return scores;
  };
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
