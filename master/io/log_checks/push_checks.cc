#include "master/io/log_checks/push_checks.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "common/math/statistics.h"
#include "common/parameters/push.h"
#include "master/io/log_checks/log_checks.h"
#include "master/io/log_checks/pose_faults.h"

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

// Finger and outlines miss or overlap one another by this share of a piece's reach, mean over
// pushes: logs of the cases by 0.003 at most where nothing of the poses is amiss; a camera whose
// aspect is 5 % off makes 0.05, pieces or pushes that are exchanged 0.03.
constexpr double kTouches = 0.01, kApart = 0.03;
constexpr double kTimesAsNear = 3;  // put right
// Of the reach, of half of the pushes: a unit 2.54 times the right one leaves some 0.5.
constexpr double kMeets = 0.1;

// By how much a point lies outside a convex outline; inside it is negative.
double outside(const Eigen::Vector2d& p_W, const Piece& piece, const Pose& X_WP) {
  double most = -INFINITY;
  Eigen::Vector2d from = transform(X_WP, piece.corners.back());
  for (const Eigen::Vector2d& corner : piece.corners) {
    const Eigen::Vector2d to = transform(X_WP, corner), edge = to - from, way = p_W - from;
    most = std::max(most, (edge.y() * way.x() - edge.x() * way.y()) / edge.norm());
    from = to;
  }
  return most;
}

// Mean over pushes of how deep the finger lies in the outline as it begins and as it ends, and of
// how far it stays off a piece that moves, m.
double misfit(const Problem& problem, const PoseFault* fault) {
  const double finger_m = problem.values[row_of(Push::kFingerRadius)];
  double sum = 0, count = 0;
  for (const Trial& t : problem.log.trials) {
    if (t.tip.empty()) continue;
    const Piece& piece = problem.piece(t.command);
    const Pose X_WS = fault == nullptr ? t.X_WS : fault->put_right(t.X_WS);
    const Pose X_WE = fault == nullptr ? t.X_WE : fault->put_right(t.X_WE);
    const auto gap = [&](const TipSample& tip, const Pose& X) {
      return outside({tip.x, tip.y}, piece, X) - finger_m;
    };
    double nearest = INFINITY;
    for (const TipSample& tip : t.tip) nearest = std::min(nearest, gap(tip, X_WS));
    const bool moved = corner_distance(piece, X_WS, X_WE) > kStill_m;
    sum += std::max(0.0, -gap(t.tip.front(), X_WS)) + std::max(0.0, -gap(t.tip.back(), X_WE)) +
           (moved ? std::max(0.0, nearest) : 0);
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

// How finger and outlines do not fit; nothing where they do.
std::optional<SanityFinding> check_outlines(const Problem& problem, double reach_m) {
  const double before_m = misfit(problem, nullptr);
  if (before_m < kTouches * reach_m) return std::nullopt;
  const PoseFault* best = nullptr;
  double after_m = before_m / kTimesAsNear;
  for (const PoseFault& fault : kPoseFaults) {
    const double put_m = misfit(problem, &fault);
    if (fault.metres != 1 || put_m >= after_m) continue;
    best = &fault;
    after_m = put_m;
  }
  SanityFinding found = {
      "frames_apart",
      "Finger and outlines miss or overlap one another by " + few_digits(1000 * before_m) +
          " mm a push.",
      "Look whether each push has its own piece, its finger's way and its poses, "
      "in one frame."};
  if (best == nullptr) {
    // A camera whose lengths are askew does as much.
    found.severity = Severity::kNote;
    return before_m < kApart * reach_m ? std::nullopt : std::optional(found);
  }
  found.name = best->name;
  found.text += " Put right, by " + few_digits(1000 * after_m) + " mm. " + best->text;
  found.remedy = best->remedy;
  if (found.name == "sides_swapped") {
    found.name = "axis_mirrored";
    found.remedy = "Negate y and theta of the pieces, or mirror the finger's way.";
  }
  return found;
}

// How deep in a piece where it ends, or how far from it, the finger's way goes: the median of
// pushes, once logged lengths are so many metres.  Nothing is pushed by a finger that hardly moves.
double misses(const Problem& problem, double piece_metres, double tip_metres, double reach_m) {
  const double finger_m = problem.values[row_of(Push::kFingerRadius)];
  std::vector<double> off, ways;
  for (const Trial& t : problem.log.trials) {
    if (t.tip.empty()) continue;
    const Pose X_WE = {piece_metres * t.X_WE.x, piece_metres * t.X_WE.y, t.X_WE.theta};
    double nearest = INFINITY, way = 0;
    for (const TipSample& s : t.tip) {
      way = std::max(way, std::hypot(s.x - t.tip.front().x, s.y - t.tip.front().y));
      nearest = std::min(
          nearest, outside({tip_metres * s.x, tip_metres * s.y}, problem.piece(t.command), X_WE));
    }
    off.push_back(std::abs(nearest - finger_m));
    ways.push_back(tip_metres * way);
  }
  return median(ways) < kMeets * reach_m ? INFINITY : median(off);
}

// Finger and pieces are far apart: a unit is named where in it they touch, push by push.
SanityFinding far_apart(const Problem& problem, double nearest_m, double reach_m) {
  const std::string seen = "The finger comes no closer to a piece's middle than " +
                           few_digits(nearest_m) +
                           " m in half of the pushes, and the farthest corner lies " +
                           few_digits(reach_m) + " m from it.";
  SanityFinding found = {"frames_apart", seen,
                         "Give finger and pieces in one frame, each push with its own finger's "
                         "way, and check the outlines' unit."};
  double least = kMeets * reach_m;
  for (const LengthUnit& unit : length_units()) {
    for (const bool pieces : {true, false}) {
      for (const bool finger : {true, false}) {
        const double left =
            misses(problem, pieces ? unit.metres : 1, finger ? unit.metres : 1, reach_m);
        if (left >= least || !(pieces || finger)) continue;
        least = left;
        const std::string whose = !finger ? "pieces" : !pieces ? "finger" : "pieces and finger";
        found = {"unit_error",
                 seen + " With the positions of " + whose + " in " + unit.name +
                     " they meet within " + few_digits(1000 * left) + " mm.",
                 "Multiply the positions of " + whose + " by " + few_digits(unit.metres) + "."};
      }
    }
  }
  return found;
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
  std::vector<TrialLength> ways;
  for (std::size_t i = 0; i < problem.log.trials.size(); ++i) {
    const std::vector<TipSample>& tip = problem.log.trials[i].tip;
    double way = 0;
    for (std::size_t k = 1; k < tip.size(); ++k) {
      way += std::hypot(tip[k].x - tip[k - 1].x, tip[k].y - tip[k - 1].y);
    }
    if (way > 0) ways.push_back({i, way});
  }
  if (check_mixed_units(problem.log, std::move(ways), "pushes",
                        "the finger's and the piece's x and y", findings)) {
    return;
  }
  const double nearest = median(distances), reach = median(reaches);
  auto outlines = check_outlines(problem, reach);
  const bool near = nearest < kFar * reach;
  if (outlines && (near || outlines->severity != Severity::kNote)) {
    findings->push_back(*std::move(outlines));
    return;
  }
  if (near) return;
  findings->push_back(far_apart(problem, nearest, reach));
}

}  // namespace gapfarm
