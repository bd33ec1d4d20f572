#include "master/diagnose/push/push_geometry.h"

#include <cmath>
#include <limits>

#include "common/base/ranges.h"
#include "common/pose/pose.h"

namespace gapfarm {
namespace {

// A finger this near has touched: logged starts miss true ones by as much.
constexpr double kTouch_m = 2e-3;
// Hands and trackers repeat a push to within these.
constexpr double kSamePlace_m = 0.02;
constexpr double kSameHeading_rad = 0.12;

struct Nearest {
  double distance_m = std::numeric_limits<double>::infinity();  // 0 inside
  double along_edge = 0;
};

// Of a convex outline, seen from a point.
Nearest nearest(const std::vector<Eigen::Vector2d>& corners, const Eigen::Vector2d& p) {
  Nearest best;
  bool inside = true;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d& a = corners[i];
    const Eigen::Vector2d& b = corners[(i + 1) % corners.size()];
    const Eigen::Vector2d edge = b - a, from = p - a;
    if (edge.x() * from.y() - edge.y() * from.x() < 0) inside = false;
    const OnSegment at = nearest_on_segment(p, a, b);
    if (at.distance < best.distance_m) best = {at.distance, 2 * at.share - 1};
  }
  if (inside) best.distance_m = 0;
  return best;
}

Eigen::Vector2d at(const TipSample& s) { return {s.x, s.y}; }

bool repeats(const Trial& a, const Trial& b) {
  const auto near = [](double x, double y) { return std::hypot(x, y) < kSamePlace_m; };
  return a.command == b.command && near(a.X_WS.x - b.X_WS.x, a.X_WS.y - b.X_WS.y) &&
         std::abs(wrap_angle(a.X_WS.theta - b.X_WS.theta)) < kSameHeading_rad &&
         near(a.tip.front().x - b.tip.front().x, a.tip.front().y - b.tip.front().y) &&
         near(a.tip.back().x - b.tip.back().x, a.tip.back().y - b.tip.back().y);
}

}  // namespace

PushGeometry push_geometry(const Piece& piece, const Trial& trial, double finger_radius_m) {
  PushGeometry push;
  push.p_RC = centroid(piece);
  const Eigen::Vector3d moments = second_moments(piece);
  push.gyration_m = std::sqrt(moments[0] + moments[1]);
  std::vector<Eigen::Vector2d> corners = mapped(
      piece.corners, [&](const Eigen::Vector2d& corner) { return transform(trial.X_WS, corner); });
  // Between samples the way is straight, and steps shorter than the margin miss nothing.
  const double reach = finger_radius_m + kTouch_m;
  Eigen::Vector2d touch = Eigen::Vector2d::Zero();
  double touch_s = 0;
  for (std::size_t i = 0; i + 1 < trial.tip.size() && !push.touched; ++i) {
    const Eigen::Vector2d from = at(trial.tip[i]), along = at(trial.tip[i + 1]) - from;
    const int steps = 1 + static_cast<int>(along.norm() / (kTouch_m / 2));
    for (int k = 0; k <= steps && !push.touched; ++k) {
      const double share = static_cast<double>(k) / steps;
      const Nearest here = nearest(corners, from + share * along);
      if (here.distance_m > reach) continue;
      push.touched = true;
      push.along_edge = here.along_edge;
      touch = from + share * along;
      touch_s = trial.tip[i].t_s + share * (trial.tip[i + 1].t_s - trial.tip[i].t_s);
    }
  }
  const Eigen::Vector2d pushed = at(trial.tip.back()) - touch;
  const double lasts_s = trial.tip.back().t_s - touch_s;
  if (!push.touched || pushed.norm() < kTouch_m || lasts_s <= 0) {
    push.touched = false;
    return push;
  }
  const Eigen::Vector2d direction = pushed.normalized();
  const Eigen::Vector2d arm = transform(trial.X_WS, push.p_RC) - touch;
  push.direction_rad = std::atan2(direction.y(), direction.x());
  push.in_piece_rad = wrap_angle(push.direction_rad - trial.X_WS.theta);
  push.arm_m = direction.x() * arm.y() - direction.y() * arm.x();
  push.pushed_m = pushed.norm();
  push.speed_m_s = pushed.norm() / lasts_s;
  return push;
}

std::vector<std::size_t> push_cells(const TrialLog& log) {
  std::vector<std::size_t> cells;
  std::vector<std::size_t> first;  // trial of each cell
  for (std::size_t i = 0; i < log.trials.size(); ++i) {
    std::size_t c = 0;
    while (c < first.size() && !repeats(log.trials[first[c]], log.trials[i])) ++c;
    if (c == first.size()) first.push_back(i);
    cells.push_back(c);
  }
  return cells;
}

}  // namespace gapfarm
