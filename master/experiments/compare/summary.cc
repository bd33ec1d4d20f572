#include "master/experiments/compare/summary.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace gapfarm {
namespace {

constexpr double kCoverage = 0.95;
constexpr int kGridPoints = 80;
// Stands for "no score yet" in sorts: behind every fitness, and finite for the rank tests.
constexpr double kNothing = 1e300;

// 1, 2, ... and then geometric steps up to the last, with multiples of ten where they fall close.
std::vector<std::uint64_t> grid_of(std::uint64_t last) {
  std::vector<std::uint64_t> grid;
  for (int i = 0; i <= kGridPoints; ++i) {
    const double share = static_cast<double>(i) / kGridPoints;
    const auto point =
        static_cast<std::uint64_t>(std::lround(std::pow(static_cast<double>(last), share)));
    if (grid.empty() || point > grid.back()) grid.push_back(point);
  }
  return grid;
}

double cost_after(const ComparedRun& run, std::uint64_t evaluations, bool higher_is_better) {
  const auto after = std::upper_bound(
      run.improvements.begin(), run.improvements.end(), evaluations,
      [](std::uint64_t e, const Improvement& improvement) { return e < improvement.evaluations; });
  if (after == run.improvements.begin()) return kNothing;
  const double fitness = std::prev(after)->fitness;
  return higher_is_better ? -fitness : fitness;
}

Interval flipped(Interval costs, bool higher_is_better) {
  return higher_is_better ? Interval{-costs.upper, -costs.lower} : costs;
}

ConvergencePoint point_of(const std::vector<double>& costs, std::uint64_t evaluations,
                          bool higher) {
  ConvergencePoint point;
  point.evaluations = evaluations;
  if (quantile(costs, 0.75) >= kNothing / 2) return point;
  const double middle = median(costs);
  point.median = higher ? -middle : middle;
  point.median_95 = flipped(median_interval(costs, kCoverage), higher);
  point.quartiles = flipped({quantile(costs, 0.25), quantile(costs, 0.75)}, higher);
  return point;
}

void add_target(const std::vector<const ComparedRun*>& runs, double target, bool higher,
                VariantSummary* to) {
  std::vector<double> needed;
  double spent = 0;
  for (const ComparedRun* run : runs) {
    const auto reached = evaluations_to(*run, target, higher);
    if (reached) needed.push_back(static_cast<double>(*reached));
    spent += static_cast<double>(reached.value_or(run->evaluations));
  }
  to->successes = needed.size();
  to->success_95 = wilson_interval(needed.size(), runs.size(), kCoverage);
  if (needed.empty()) return;
  to->median_to_target = median(needed);
  to->expected_to_target = spent / static_cast<double>(needed.size());
}

// Final costs as blocks: [seed][variant].
void add_ranks(const std::vector<std::vector<double>>& blocks, ComparisonSummary* to) {
  const std::size_t count = to->variants.size();
  to->pair_p.assign(count, std::vector<double>(count, 1));
  for (const std::vector<double>& block : blocks) {
    const std::vector<double> ranks = mean_ranks(block);
    for (std::size_t v = 0; v < count; ++v) {
      to->variants[v].mean_rank += ranks[v] / static_cast<double>(blocks.size());
    }
  }
  if (count < 2) return;
  to->all = friedman(blocks);
  const auto column = [&](std::size_t v) {
    std::vector<double> values;
    for (const std::vector<double>& block : blocks) values.push_back(block[v]);
    return values;
  };
  std::vector<double> p;
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = a + 1; b < count; ++b) p.push_back(mann_whitney(column(a), column(b)).p);
  }
  const std::vector<double> adjusted = holm(p);
  auto next = adjusted.begin();
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = a + 1; b < count; ++b) to->pair_p[a][b] = to->pair_p[b][a] = *next++;
  }
}

}  // namespace

std::optional<std::uint64_t> evaluations_to(const ComparedRun& run, double target,
                                            bool higher_is_better) {
  for (const Improvement& improvement : run.improvements) {
    if (higher_is_better ? improvement.fitness >= target : improvement.fitness <= target) {
      return improvement.evaluations;
    }
  }
  return std::nullopt;
}

ComparisonSummary summarise_comparison(std::span<const Variant> variants,
                                       const std::vector<ComparedRun>& runs,
                                       const CompareOptions& options,
                                       std::optional<double> target) {
  const FitnessKind kind = variants.front().config.problem.fitness.kind;
  ComparisonSummary summary;
  summary.fitness = fitness_name(kind);
  summary.higher_is_better = higher_is_better(kind);
  summary.target = target;
  summary.evaluations = options.evaluations;
  summary.seeds = options.seeds;
  const bool higher = summary.higher_is_better;
  std::vector<std::vector<double>> blocks(options.seeds);
  for (std::size_t v = 0; v < variants.size(); ++v) {
    std::vector<const ComparedRun*> own;
    for (const ComparedRun& run : runs) {
      if (run.variant == v) own.push_back(&run);
    }
    assert(own.size() == options.seeds);
    const auto costs_after = [&](std::uint64_t evaluations) {
      std::vector<double> costs;
      for (const ComparedRun* run : own) costs.push_back(cost_after(*run, evaluations, higher));
      return costs;
    };
    VariantSummary of;
    of.name = variants[v].name;
    for (const std::uint64_t evaluations : grid_of(options.evaluations)) {
      of.convergence.push_back(point_of(costs_after(evaluations), evaluations, higher));
    }
    const std::vector<double> last = costs_after(options.evaluations);
    for (std::size_t s = 0; s < last.size(); ++s) {
      blocks[s].push_back(last[s]);
      of.final_fitness.push_back(last[s] >= kNothing ? NAN : higher ? -last[s] : last[s]);
    }
    const ConvergencePoint end = of.convergence.back();
    of.median = end.median.value_or(NAN);
    of.median_95 = end.median_95;
    if (target) add_target(own, *target, higher, &of);
    summary.variants.push_back(std::move(of));
  }
  add_ranks(blocks, &summary);
  return summary;
}

}  // namespace gapfarm
