// Searches side by side: every variant over the same seeds with the same number of evaluations.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/config/config.h"
#include "common/math/rank_tests.h"
#include "master/evolve/evolve.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct CompareOptions {
  unsigned seeds = 10;
  std::uint64_t first_seed = 1;
  std::uint64_t evaluations = 1000;  // of every run
};

// Best fitness so far after `evaluations` scores, written down whenever it changes.
struct Improvement {
  std::uint64_t evaluations = 0;
  double fitness = 0;
};

struct ComparedRun {
  std::size_t variant = 0;
  std::uint64_t seed = 0;
  std::vector<Improvement> improvements;  // empty: nothing ever scored
  std::uint64_t evaluations = 0;          // made; fewer than asked when nothing new was left
};

// Variants of one name get their config's path instead; those of one path are numbered.
void name_apart(std::vector<Variant>& variants);

// Runs all of them in step, so that a farm always has work.  Every run of a variant is the run that
// `evolve` would make with that seed, but for its stop conditions.  Errors: of the optimisers'
// setup and of the farm.
Result<std::vector<ComparedRun>> compare(Farm& farm, std::span<const Variant> variants,
                                         const CompareOptions& options);

// What a comparison's runs say: convergence, success, ranks.

// Something that no search tuned, and its fitness.
struct Baseline {
  std::string name;
  std::optional<double> fitness;  // none: it did not end well
};

// Of the best fitness so far over a variant's seeds, after `evaluations`.  Runs without any score
// yet count as the worst.  None of the numbers when half of the runs have none.
struct ConvergencePoint {
  std::uint64_t evaluations = 0;
  std::optional<double> median;
  Interval median_95;  // distribution-free
  Interval quartiles;
};

struct VariantSummary {
  std::string name;
  std::vector<ConvergencePoint> convergence;  // on a grid common to all variants
  std::vector<double> final_fitness;          // one a run, in seed order
  double median = 0;
  Interval median_95;
  double mean_rank = 0;       // of the final fitness among the variants, over seeds; 1 is the best
  std::size_t successes = 0;  // runs that reached the target
  Interval success_95;        // of their share (Wilson)
  std::optional<double> median_to_target;  // evaluations, over the runs that reached it
  // Evaluations spent by all runs until they reached the target or ended, a success (ERT; Hansen et
  // al. 2009).
  std::optional<double> expected_to_target;
};

struct ComparisonSummary {
  std::string fitness;  // name
  bool higher_is_better = false;
  std::optional<double> target;
  std::uint64_t evaluations = 0;
  unsigned seeds = 0;
  std::vector<Baseline> baselines;
  std::vector<VariantSummary> variants;
  RankTest all;  // Friedman over seeds
  // Mann-Whitney of two variants' final fitness, by Holm adjusted over all pairs; 1 on the
  // diagonal.
  std::vector<std::vector<double>> pair_p;
};

// `runs` as compare() returns them.  REQUIRES: at least one variant and one run each.
ComparisonSummary summarise_comparison(std::span<const Variant> variants,
                                       const std::vector<ComparedRun>& runs,
                                       const CompareOptions& options, std::optional<double> target);

// A line a variant and baseline, for people.
std::string comparison_text(const ComparisonSummary& summary);

// CSV tables: a line a variant; a line a run; a line a variant and grid point.
std::string summary_csv(const ComparisonSummary& summary);
std::string runs_csv(const ComparisonSummary& summary, const std::vector<ComparedRun>& runs);
std::string convergence_csv(const ComparisonSummary& summary);

// One self-contained page with plots.
std::string comparison_page(const ComparisonSummary& summary, const std::string& title,
                            const std::vector<std::pair<std::string, std::string>>& provenance);

}  // namespace gapfarm
