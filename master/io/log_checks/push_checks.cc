#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "common/parameters/table.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {
namespace {

constexpr double kStill_m = 0.0005, kStill_rad = 0.005;
constexpr double kFar = 2;  // of the farthest corner: no finger that touches is so far away

double reach_of(const Piece& piece) {
  const Eigen::Vector2d middle = centroid(piece);
  return max_of(piece.corners, [&](const auto& corner) { return (corner - middle).norm(); });
}

// Finger and outlines miss or overlap one another by this share of a piece's reach, mean over
// pushes: logs of the cases by 0.003 at most where nothing of the poses is amiss; a camera whose
// aspect is 5 % off makes 0.05, pieces or pushes that are exchanged 0.03.
constexpr double kTouches = 0.01, kApart = 0.03;
constexpr double kTimesAsNear = 3;  // put right
constexpr double kAsWell = 1.1;     // of what two readings leave
// Of the reach, of half of the pushes: a unit 2.54 times the right one leaves some 0.5.
constexpr double kMeets = 0.1;
constexpr double kTimesUsual = 4;    // what the share below stays under
constexpr double kTrueShare = 0.75;  // of the pushes: the rest may be false

// Of the finger, m.
double way_of(const Trial& t) {
  double way = 0;
  for (std::size_t k = 1; k < t.tip.size(); ++k) {
    way += std::hypot(t.tip[k].x - t.tip[k - 1].x, t.tip[k].y - t.tip[k - 1].y);
  }
  return way;
}

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

// In which ways the pieces' poses are the wrong way round, and put right.
struct PoseFault {
  const char* name;
  const char* text;
  const char* remedy;
  double x_x, x_y;     // x put right, of x and y as logged
  double y_x, y_y;     // and y
  double sense, turn;  // of headings; rad

  Pose put_right(const Pose& X) const {
    return {x_x * X.x + x_y * X.y, y_x * X.x + y_y * X.y, sense * X.theta + turn};
  }
};

constexpr PoseFault kPoseFaults[] = {
    {"axis_mirrored", "What should turn left turns right.",
     "Negate y and theta of the pieces, or mirror the finger's way.", 1, 0, 0, -1, -1, 0},
    {"heading_flipped", "Headings grow the other way round than turns do.", "Negate theta.", 1, 0,
     0, 1, -1, 0},
    {"axis_mirrored", "One axis points the other way than headings say.", "Negate x or y.", 1, 0, 0,
     -1, 1, 0},
    {"axis_mirrored", "One axis points the other way than headings say.", "Negate x or y.", -1, 0,
     0, 1, 1, 0},
    {"axes_swapped", "x and y are exchanged.", "Exchange x and y.", 0, 1, 1, 0, 1, 0},
    {"heading_turned", "Headings are half a turn off.", "Add pi to theta, or set marker.yaw.", 1, 0,
     0, 1, 1, M_PI},
    {"heading_turned", "Headings are a quarter turn off.", "Add pi/2 to theta, or set marker.yaw.",
     1, 0, 0, 1, 1, M_PI / 2},
    {"heading_turned", "Headings are a quarter turn off.",
     "Subtract pi/2 from theta, or set marker.yaw.", 1, 0, 0, 1, 1, -M_PI / 2}};

// As what a log is read: with its pieces' poses put right, in other units.
struct LogReading {
  const PoseFault* fault = nullptr;
  bool exchanged = false;  // before and after
  bool mirrored = false;   // the finger's way
  double piece_metres = 1, tip_metres = 1;
  const Piece *one = nullptr, *other = nullptr;  // whose names are exchanged

  const Piece& piece(const Problem& problem, const Trial& t) const {
    const Piece& named = problem.piece(t.command);
    return &named == one ? *other : &named == other ? *one : named;
  }

  Pose start(const Trial& t) const { return pose(exchanged ? t.X_WE : t.X_WS); }
  Pose end(const Trial& t) const { return pose(exchanged ? t.X_WS : t.X_WE); }
  Eigen::Vector2d point(const TipSample& tip) const {
    return {tip_metres * tip.x, (mirrored ? -tip_metres : tip_metres) * tip.y};
  }

 private:
  Pose pose(const Pose& X) const {
    const Pose right = fault == nullptr ? X : fault->put_right(X);
    return {piece_metres * right.x, piece_metres * right.y, right.theta};
  }
};

// How far the finger stays off the outline at its start; below 0: it goes into it.
double nearest_gap(const Problem& problem, const Trial& t, const LogReading& as) {
  const Piece& piece = as.piece(problem, t);
  double nearest = INFINITY;
  for (const TipSample& tip : t.tip) {
    nearest = std::min(nearest, outside(as.point(tip), piece, as.start(t)));
  }
  return nearest - problem.values[row_of(Push::kFingerRadius)];
}

bool moves(const Problem& problem, const Trial& t) {
  return corner_distance(problem.piece(t.command), t.X_WS, t.X_WE) > kStill_m;
}

// Mean over pushes of how deep the finger lies in the outline as it begins and as it ends, and of
// how far it stays off a piece that moves, m.
double misfit(const Problem& problem, const LogReading& as) {
  const double finger_m = problem.values[row_of(Push::kFingerRadius)];
  double sum = 0, count = 0;
  for (const Trial& t : problem.log.trials) {
    if (t.tip.empty()) continue;
    const Piece& piece = as.piece(problem, t);
    const Pose X_WS = as.start(t), X_WE = as.end(t);
    const auto depth = [&](const TipSample& tip, const Pose& X) {
      return std::max(0.0, finger_m - outside(as.point(tip), piece, X));
    };
    sum += depth(t.tip.front(), X_WS) + depth(t.tip.back(), X_WE);
    if (moves(problem, t)) sum += std::max(0.0, nearest_gap(problem, t, as));
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

// How deep in a piece where it ends, or how far from it, the finger's way goes: the median of
// pushes, read so.  Nothing is pushed by a finger that hardly moves.
double misses(const Problem& problem, const LogReading& as, double reach_m) {
  const double finger_m = problem.values[row_of(Push::kFingerRadius)];
  std::vector<double> off, ways;
  for (const Trial& t : problem.log.trials) {
    if (t.tip.empty()) continue;
    const Pose X_WE = as.end(t);
    double nearest = INFINITY, way = 0;
    for (const TipSample& s : t.tip) {
      way = std::max(way, std::hypot(s.x - t.tip.front().x, s.y - t.tip.front().y));
      nearest = std::min(nearest, outside(as.point(s), as.piece(problem, t), X_WE));
    }
    off.push_back(std::abs(nearest - finger_m));
    ways.push_back(as.tip_metres * way);
  }
  return median(ways) < kMeets * reach_m ? INFINITY : median(off);
}

// How finger and outlines do not fit; nothing where they do.
std::optional<SanityFinding> check_outlines(const Problem& problem, double reach_m) {
  const double before_m = misfit(problem, {}), missed_m = misses(problem, {}, reach_m);
  const bool touches = before_m < kTouches * reach_m;
  if (touches && missed_m < kMeets * reach_m) return std::nullopt;
  SanityFinding found = {
      "frames_apart",
      "Finger and outlines miss or overlap one another by " + few_digits(1000 * before_m) +
          " mm a push" +
          (std::isfinite(missed_m)
               ? ", and half of them by " + few_digits(1000 * missed_m) + " mm where they end."
               : "."),
      "Look whether each push has its own piece, its finger's way and its poses, in one frame, and "
      "whether finger_radius, " +
          few_digits(1000 * problem.values[row_of(Push::kFingerRadius)]) + " mm, is the finger's.",
      // A camera whose lengths are askew does as much.
      Severity::kNote};
  const std::string seen = found.text;
  double least_m = INFINITY;
  const auto take = [&](const LogReading& as, const char* name, const std::string& text,
                        const std::string& remedy) {
    const double put_m = misfit(problem, as), misses_m = misses(problem, as, reach_m);
    // A finger that stands still or goes elsewhere fits outlines that are put out of its way.
    if (misses_m >= kMeets * reach_m || (touches && misses_m >= missed_m / kTimesAsNear)) return;
    if (put_m >= std::max(before_m, kTouches * reach_m) / kTimesAsNear) return;
    const double left_m = put_m + misses_m;
    const bool as_good = left_m <= kAsWell * least_m && least_m <= kAsWell * left_m;
    if (as_good) found.remedy += " Or else: " + text + " " + remedy;
    if (as_good || left_m >= least_m) return;
    least_m = left_m;
    found = {name,
             seen + " Put right, by " + few_digits(1000 * put_m) + " and " +
                 few_digits(1000 * misses_m) + " mm. " + text,
             remedy};
  };
  for (const PoseFault& fault : kPoseFaults) {
    take({.fault = &fault}, fault.name, fault.text, fault.remedy);
  }
  take({.fault = &kPoseFaults[0], .mirrored = true}, "axis_mirrored",
       "The frame of pieces and finger is mirrored.",
       "Negate y and theta of the pieces and y of the finger.");
  take({.exchanged = true}, kEndsSwapped, "Before and after are exchanged.", kExchangeEnds);
  for (const Piece& one : problem.pieces) {
    for (const Piece& other : std::span(&one, std::to_address(problem.pieces.end())).subspan(1)) {
      take({.one = &one, .other = &other}, "pieces_swapped",
           "The names " + one.name + " and " + other.name + " are exchanged.",
           "Exchange these names.");
    }
  }
  if (found.severity == Severity::kNote && before_m < kApart * reach_m) return std::nullopt;
  return found;
}

// Most pieces move although their finger does not come to them; a few are a tracker's.
std::optional<SanityFinding> check_touches(const Problem& problem, double reach_m) {
  const double off_m = kApart * reach_m;
  std::size_t untouched = 0, still = 0, moved = 0;
  for (const Trial& t : problem.log.trials) {
    if (t.tip.empty() || !moves(problem, t)) continue;
    ++moved;
    if (nearest_gap(problem, t, {}) <= off_m) continue;
    ++untouched;
    if (way_of(t) < kStill_m) ++still;
  }
  if (2 * untouched <= moved) return std::nullopt;
  const std::string stay =
      still == 0 ? "" : ", and " + std::to_string(still) + " of these fingers do not move at all";
  return SanityFinding{"untouched",
                       std::to_string(untouched) + " of " + std::to_string(moved) +
                           " pieces that move are more than " + few_digits(1000 * off_m) +
                           " mm away from all of their finger's way" + stay + ".",
                       "Give each push the whole way of its own finger, in the frame and unit of "
                       "the pieces' poses."};
}

// Where finger and pieces do not meet: a unit is named where in it they touch, push by push.
SanityFinding far_apart(const Problem& problem, double nearest_m, double reach_m) {
  const std::string seen = "The finger comes no closer to a piece's middle than " +
                           few_digits(nearest_m) +
                           " m in half of the pushes, and the farthest corner lies " +
                           few_digits(reach_m) + " m from it.";
  SanityFinding found = {"frames_apart", seen,
                         "Give finger and pieces in one frame, each push with its own finger's "
                         "way, and check the outlines' unit."};
  double least = std::min(kMeets * reach_m, misses(problem, {}, reach_m) / kTimesAsNear);
  for (const LengthUnit& unit : length_units()) {
    for (const bool pieces : {true, false}) {
      for (const bool finger : {true, false}) {
        const LogReading as = {.piece_metres = pieces ? unit.metres : 1,
                               .tip_metres = finger ? unit.metres : 1};
        const double left = misses(problem, as, reach_m);
        if (left >= least || !(pieces || finger)) continue;
        if (misfit(problem, as) >= kMeets * reach_m) continue;
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

// The fingers' ways as what check_jumps() looks at.
RunLog tip_runs(const TrialLog& log) {
  RunLog runs;
  for (const Trial& trial : log.trials) {
    LoggedRun& run = runs.runs.emplace_back();
    for (const TipSample& s : trial.tip) run.poses.push_back({s.t_s, {s.x, s.y, 0}});
  }
  return runs;
}

}  // namespace

TipJumps check_tip_jumps(const TrialLog& log) {
  const auto samples = check_jumps(tip_runs(log)).false_poses;
  TipJumps jumps;
  for (const auto& [trial, sample] : samples) {
    if (jumps.trials.empty() || jumps.trials.back() != trial) jumps.trials.push_back(trial);
  }
  if (samples.empty()) return jumps;
  const auto& [first, at] = *samples.begin();
  const Trial& trial = log.trials[first];
  const TipSample& s = trial.tip[at];
  const std::string file = trial.tip_file.empty() ? "tips.csv" : trial.tip_file;
  jumps.findings.push_back(
      {"tip_jumps",
       "The finger jumps there and back in " + std::to_string(jumps.trials.size()) +
           " pushes, to where no step of it leads (the first: " + file +
           (s.line > 0 ? ":" + std::to_string(s.line) : "") + ", session " + trial.session +
           ", trial " + std::to_string(trial.trial) + ", x = " + few_digits(s.x) +
           " m, y = " + few_digits(s.y) + " m at t = " + few_digits(s.t_s) + " s).",
       "Remove such rows, " + std::to_string(samples.size()) +
           " in all, from the fingers' ways; a diagnosis leaves these pushes out.",
       Severity::kNote});
  return jumps;
}

std::vector<std::size_t> against_their_fingers(const Problem& problem) {
  if (problem.pieces.empty()) return {};
  const double finger_m = problem.values[row_of(Push::kFingerRadius)];
  const std::vector<Trial>& trials = problem.log.trials;
  const auto off = mapped(trials, [&](const Trial& t) {
    if (t.tip.empty()) return 0.0;
    const Piece& piece = problem.piece(t.command);
    const Eigen::Vector2d tip(t.tip.back().x, t.tip.back().y), middle = centroid(piece);
    const Eigen::Vector2d start = transform(t.X_WS, middle);
    const double moved = (transform(t.X_WE, middle) - start).norm();
    const double inside = finger_m - outside(tip, piece, t.X_WE), reach = reach_of(piece);
    const auto off_middle = [&](const TipSample& at) {
      return std::hypot(at.x - start.x(), at.y - start.y());
    };
    // A lens or a late clock leaves a finger nearer than that.
    const double nearest = std::ranges::min(mapped(t.tip, off_middle)) - finger_m - 2 * reach;
    const double untouched = std::min(corner_distance(piece, t.X_WS, t.X_WE), nearest);
    return std::max({0.0, inside, moved - way_of(t), untouched}) / reach;
  });
  const double most = off.empty() ? 0 : std::max(kMeets, kTimesUsual * quantile(off, kTrueShare));
  return filtered(indices(off.size()), [&](std::size_t i) { return off[i] > most; });
}

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
    const double way = way_of(problem.log.trials[i]);
    if (way > 0) ways.push_back({i, way});
  }
  if (check_mixed_units(problem.log, std::move(ways), "pushes",
                        "the finger's and the piece's x and y", findings)) {
    return;
  }
  const double nearest = median(distances), reach = median(reaches);
  auto found = check_outlines(problem, reach);
  if (!found || found->severity == Severity::kNote) {
    const bool near = nearest < kFar * reach;
    if (near && !found && misses(problem, {}, reach) < kMeets * reach) return;
    SanityFinding apart = far_apart(problem, nearest, reach);
    if (!near || apart.name == "unit_error") {
      found = std::move(apart);
    } else if (auto untouched = check_touches(problem, reach)) {
      found = std::move(untouched);
    }
  }
  if (found) findings->push_back(*std::move(found));
}

}  // namespace gapfarm
