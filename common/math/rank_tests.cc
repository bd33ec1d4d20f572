#include "common/math/rank_tests.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

#include "common/base/ranges.h"
#include "common/math/laws.h"

namespace gapfarm {
namespace {

constexpr std::size_t kExact = 30;

// P(U <= u) without ties: the number of ways to choose a's ranks, by their sum.
double exact_share_up_to(double u, std::size_t a, std::size_t b) {
  const std::size_t most = a * b;
  // ways[k][s]: subsets of k ranks whose U is s, over the ranks so far.
  std::vector<std::vector<double>> counts(a + 1, std::vector<double>(most + 1, 0));
  counts[0][0] = 1;
  for (std::size_t rank = 0; rank < a + b; ++rank) {
    for (std::size_t k = std::min(a, rank + 1); k >= 1; --k) {
      const std::size_t gain = rank - (k - 1);  // values of b below the k-th of a
      if (gain > b) continue;
      for (std::size_t s = gain; s <= most; ++s) counts[k][s] += counts[k - 1][s - gain];
    }
  }
  const double all = std::accumulate(counts[a].begin(), counts[a].end(), 0.0);
  const auto last = static_cast<std::ptrdiff_t>(std::floor(u)) + 1;
  return std::accumulate(counts[a].begin(), counts[a].begin() + last, 0.0) / all;
}

// Sum of t^3 - t over groups of t equal values.
double tie_sum(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  double sum = 0;
  for (std::size_t i = 0; i < values.size();) {
    std::size_t end = i;
    while (end < values.size() && values[end] == values[i]) ++end;
    const auto t = static_cast<double>(end - i);
    sum += t * t * t - t;
    i = end;
  }
  return sum;
}

}  // namespace

std::vector<double> mean_ranks(std::span<const double> values) {
  const std::vector<std::size_t> order = order_of(values);
  std::vector<double> ranks(values.size());
  for (std::size_t i = 0; i < order.size();) {
    std::size_t end = i;
    while (end < order.size() && values[order[end]] == values[order[i]]) ++end;
    const double rank = static_cast<double>(i + end + 1) / 2;
    for (; i < end; ++i) ranks[order[i]] = rank;
  }
  return ranks;
}

RankTest mann_whitney(std::span<const double> a, std::span<const double> b) {
  assert(!a.empty() && !b.empty());
  std::vector<double> all(a.begin(), a.end());
  all.insert(all.end(), b.begin(), b.end());
  const std::vector<double> ranks = mean_ranks(all);
  const auto m = static_cast<double>(a.size()), n = static_cast<double>(b.size());
  const double sum =
      std::accumulate(ranks.begin(), ranks.begin() + static_cast<long>(a.size()), 0.0);
  RankTest test;
  test.statistic = sum - m * (m + 1) / 2;
  const double ties = tie_sum(all);
  const double least = std::min(test.statistic, m * n - test.statistic);
  if (ties == 0 && a.size() <= kExact && b.size() <= kExact) {
    test.p = std::min(1.0, 2 * exact_share_up_to(least, a.size(), b.size()));
    return test;
  }
  const double total = m + n;
  const double variance = m * n / 12 * (total + 1 - ties / (total * (total - 1)));
  if (!(variance > 0)) return test;
  const double z = std::max(0.0, m * n / 2 - least - 0.5) / std::sqrt(variance);
  test.p = std::min(1.0, 2 * normal_above(z));
  return test;
}

RankTest friedman(const std::vector<std::vector<double>>& values) {
  assert(!values.empty() && values.front().size() >= 2);
  const std::size_t treatments = values.front().size();
  const auto k = static_cast<double>(treatments), n = static_cast<double>(values.size());
  std::vector<double> sums(treatments);
  double ties = 0;
  for (const std::vector<double>& block : values) {
    assert(block.size() == treatments);
    const std::vector<double> ranks = mean_ranks(block);
    for (std::size_t j = 0; j < treatments; ++j) sums[j] += ranks[j];
    ties += tie_sum(block);
  }
  double squares = 0;
  for (double sum : sums) squares += (sum - n * (k + 1) / 2) * (sum - n * (k + 1) / 2);
  const double denominator = n * k * (k + 1) / 12 - ties / (12 * (k - 1));
  RankTest test;
  if (!(denominator > 1e-12)) return test;
  test.statistic = squares / denominator;
  test.p = chi_squared_above(k - 1, test.statistic);
  return test;
}

Interval median_interval(std::span<const double> values, double coverage) {
  const std::size_t n = values.size();
  if (1 - 2 * std::pow(0.5, n) < coverage) return {NAN, NAN};
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  // [j, n - 1 - j] holds the median unless j or fewer values lie on one side of it.
  std::size_t j = 0;
  while (j + 1 < n - 1 - j &&
         1 - 2 * binomial_below(static_cast<double>(n), 0.5, static_cast<double>(j + 1)) >=
             coverage) {
    ++j;
  }
  return {sorted[j], sorted[n - 1 - j]};
}

Interval wilson_interval(std::size_t successes, std::size_t trials, double coverage) {
  assert(successes <= trials);
  if (trials == 0) return {0, 1};
  const double z = normal_quantile((1 + coverage) / 2);
  const auto n = static_cast<double>(trials);
  const double share = static_cast<double>(successes) / n;
  const double centre = (share + z * z / (2 * n)) / (1 + z * z / n);
  const double half =
      z / (1 + z * z / n) * std::sqrt(share * (1 - share) / n + z * z / (4 * n * n));
  return {successes == 0 ? 0 : centre - half, successes == trials ? 1 : centre + half};
}

}  // namespace gapfarm
