#include "common/math/path_distance.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace gapfarm {
namespace {

double directed_hausdorff(std::span<const PathPoint> from, std::span<const PathPoint> to) {
  double greatest = 0;
  for (const PathPoint& p : from) {
    double nearest = INFINITY;
    for (const PathPoint& q : to) nearest = std::min(nearest, (p - q).squaredNorm());
    greatest = std::max(greatest, nearest);
  }
  return std::sqrt(greatest);
}

}  // namespace

double lettier_distance(std::span<const PathPoint> a, std::span<const PathPoint> b) {
  assert(!a.empty() && !b.empty());
  double greatest = 0;
  for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    const PathPoint& p = a[std::min(i, a.size() - 1)];
    const PathPoint& q = b[std::min(i, b.size() - 1)];
    greatest = std::max(greatest, (p - q).norm());
  }
  return greatest;
}

double hausdorff_distance(std::span<const PathPoint> a, std::span<const PathPoint> b) {
  assert(!a.empty() && !b.empty());
  return std::max(directed_hausdorff(a, b), directed_hausdorff(b, a));
}

double frechet_distance(std::span<const PathPoint> a, std::span<const PathPoint> b) {
  assert(!a.empty() && !b.empty());
  // leash[j]: of the best walk to the present point of `a` and point j of `b`.
  std::vector<double> leash(b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    double diagonal = i == 0 ? 0 : leash[0];
    for (std::size_t j = 0; j < b.size(); ++j) {
      const double above = leash[j];
      double before = diagonal;  // the only way to the first pair costs nothing yet
      if (j > 0) before = i > 0 ? std::min({diagonal, above, leash[j - 1]}) : leash[j - 1];
      leash[j] = std::max(before, (a[i] - b[j]).norm());
      diagonal = above;
    }
  }
  return leash.back();
}

}  // namespace gapfarm
