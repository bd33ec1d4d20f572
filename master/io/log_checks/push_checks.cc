#include "master/io/log_checks/push_checks.h"

#include <algorithm>
#include <cmath>

#include "common/math/statistics.h"
#include "common/parameters/push.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

constexpr double kStill_m = 0.0005, kStill_rad = 0.005;
constexpr double kFar = 2;  // of the farthest corner: no finger that touches is so far away

double reach_of(const Piece& piece) {
  double reach = 0;
  const Eigen::Vector2d middle = centroid(piece);
  for (const Eigen::Vector2d& corner : piece.corners) {
    reach = std::max(reach, (corner - middle).norm());
  }
  return reach;
}

}  // namespace

void check_pushes(const Problem& problem, std::vector<SanityFinding>* findings) {
  const double finger = problem.values[row_of(Push::kFingerRadius)];
  std::vector<double> moved, turned, distances, reaches;
  for (const Trial& t : problem.log.trials) {
    const Piece& piece = problem.piece(t.command);
    const Eigen::Vector2d middle = transform(t.X_WS, centroid(piece));
    double nearest = INFINITY;
    for (const TipSample& s : t.tip) {
      nearest = std::min(nearest, std::hypot(s.x - middle.x(), s.y - middle.y()));
    }
    moved.push_back(std::hypot(t.X_WE.x - t.X_WS.x, t.X_WE.y - t.X_WS.y));
    turned.push_back(std::abs(wrap_angle(t.X_WE.theta - t.X_WS.theta)));
    if (!std::isfinite(nearest)) continue;
    distances.push_back(nearest);
    reaches.push_back(reach_of(piece) + finger);
  }
  if (moved.empty()) return;
  if (quantile(moved, 0.9) < kStill_m && quantile(turned, 0.9) < kStill_rad) {
    findings->push_back(
        {"no_motion",
         "Nine in ten pushes move their piece by less than " + few_digits(1000 * kStill_m) + " mm.",
         "Look whether the poses are those of the pieces that were pushed."});
    return;
  }
  if (distances.empty()) return;
  const double nearest = median(distances), reach = median(reaches);
  if (nearest < kFar * reach) return;
  const LengthUnit* unit = likely_unit(nearest, 0, reach, reach / 2);
  const std::string seen = "The finger comes no closer to a piece's middle than " +
                           few_digits(nearest) +
                           " m in half of the pushes, and the farthest corner "
                           "lies " +
                           few_digits(reach) + " m from it.";
  if (unit != nullptr) {
    findings->push_back(
        {"unit_error", seen + " These look like " + unit->name + ".",
         "Multiply positions of pieces and finger by " + few_digits(unit->metres) + "."});
  } else {
    findings->push_back({"frames_apart", seen,
                         "Give finger and pieces in one frame, and check the outlines' unit."});
  }
}

}  // namespace gapfarm
