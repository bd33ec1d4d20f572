#include "common/math/importance.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <vector>

#include "common/math/statistics.h"

namespace gapfarm {
namespace {

double squares_about_mean(std::span<const double> values) {
  const double middle = mean(values);
  double sum = 0;
  for (const double v : values) sum += (v - middle) * (v - middle);
  return sum;
}

}  // namespace

double first_order_index(std::span<const double> x, std::span<const double> y) {
  assert(x.size() == y.size());
  const std::size_t n = x.size();
  if (n < kLeastForImportance) return 0;
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return x[a] < x[b]; });
  std::vector<double> sorted;
  for (const std::size_t i : order) sorted.push_back(y[i]);
  const double whole = squares_about_mean(sorted);
  if (!(whole > 0)) return 0;
  // Rice's rule.
  const auto wanted = 2 * std::cbrt(static_cast<double>(n));
  const auto each = static_cast<std::size_t>(std::ceil(static_cast<double>(n) / wanted));
  double within = 0;
  std::size_t classes = 0;
  for (std::size_t from = 0; from < n; ++classes) {
    std::size_t to = std::min(n, from + each);
    while (to < n && x[order[to]] == x[order[to - 1]]) ++to;
    within += squares_about_mean(std::span(sorted).subspan(from, to - from));
    from = to;
  }
  const auto free = static_cast<double>(n - classes), all = static_cast<double>(n - 1);
  return std::clamp(1 - within / whole * all / free, 0.0, 1.0);
}

}  // namespace gapfarm
