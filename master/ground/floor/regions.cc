#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "common/base/constants.h"
#include "master/ground/fit/held_out.h"
#include "master/ground/hypotheses.h"
#include "master/ground/tolerances.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// Lines that are looked at: normals 15 degrees apart, all round, since either floor may be the one
// that the file is right on; at each those with these shares of the wheels' places before them.
constexpr int kAngles = 24;
constexpr double kShares[] = {0.03, 0.06, 0.12, 0.22, 0.35, 0.5, 0.65, 0.78, 0.88, 0.94, 0.97};
// Circles that are looked at: round the places of these shares along either axis, with these radii
// over what the places scatter by.
constexpr double kMiddles[] = {0.08, 0.25, 0.42, 0.58, 0.75, 0.92};
constexpr double kRadii[] = {0.35, 0.6, 1};
constexpr double kLeastPlaces = 3 * kFolds;  // so that each fold has some to be predicted
constexpr double kThrottleTried = 0.2;       // of the tried ratios: 5 % of the weight, a carpet
constexpr std::size_t kClimbed = 4;          // of the groups, each from its best
constexpr int kClimbingRounds = 6;

using Eigen::Vector2d, Eigen::VectorXd;
using Starts = std::vector<VectorXd>;

// Where wheels stand where windows begin, from the fitter's origin.
std::vector<Vector2d> wheel_places(const WindowFitter& fitter) {
  const Pose X_MR = inverse(fitter.robot().X_RM);
  std::vector<Vector2d> places;
  for (const Trial& trial : fitter.windows().trials) {
    for (const RobotWheel& wheel : fitter.robot().wheels) {
      if (!wheel.driven) continue;
      const Pose at = trial.X_WS * X_MR * Pose{wheel.x_m.value_or(0), wheel.y_m.value_or(0), 0};
      places.emplace_back(Vector2d(at.x, at.y) - fitter.origin_m());
    }
  }
  return places;
}

// The places' distances along a direction, ascending.
std::vector<double> along(const std::vector<Vector2d>& places, const Vector2d& direction) {
  std::vector<double> distances;
  for (const Vector2d& place : places) distances.push_back(place.dot(direction));
  std::ranges::sort(distances);
  return distances;
}

double at_share(const std::vector<double>& ascending, double share) {
  return ascending[static_cast<std::size_t>(share * static_cast<double>(ascending.size() - 1))];
}

double scatter_of(const std::vector<Vector2d>& places) {
  const auto n = static_cast<double>(places.size());
  Vector2d sum(0, 0);
  double squares = 0;
  for (const Vector2d& place : places) {
    sum += place;
    squares += place.squaredNorm();
  }
  return std::sqrt(squares / n - (sum / n).squaredNorm());
}

Vector2d direction_of(double angle) { return {std::cos(angle), std::sin(angle)}; }

// The parts of the floor that some values state.
struct Line {
  // Ratios that are tried beside what slopes promise, as of two floors that differ clearly.  Lines
  // are looked at from either side.
  static constexpr double kTried[] = {0.75};
  double angle, offset, ratio;

  Line(const std::vector<FitRow>& rows, const VectorXd& values)
      : angle(values[row_index(rows, "edge_angle")]),
        offset(values[row_index(rows, "edge_offset")]),
        ratio(values[row_index(rows, "edge_ratio")]) {}
  bool may_be(const std::vector<Vector2d>&) const { return ratio > 0; }
  bool has(const Vector2d& place) const { return place.dot(direction_of(angle)) > offset; }
};

struct Circle {
  static constexpr double kTried[] = {0.75, 1 / 0.75};
  Vector2d middle;
  double radius, ratio;

  Circle(const std::vector<FitRow>& rows, const VectorXd& values)
      : middle(values[row_index(rows, "patch_x")], values[row_index(rows, "patch_y")]),
        radius(values[row_index(rows, "patch_radius")]),
        ratio(values[row_index(rows, "patch_ratio")]) {}
  // One that is larger than the log reaches is an edge.
  bool may_be(const std::vector<Vector2d>& places) const {
    return ratio > 0 && radius < kLargestPatch * scatter_of(places);
  }
  bool has(const Vector2d& place) const { return (place - middle).norm() < radius; }
};

// How many of the wheels' places lie on the region's floor.
template <typename Region>
double places_there(const std::vector<Vector2d>& places, const Region& region) {
  return static_cast<double>(
      std::ranges::count_if(places, [&](const Vector2d& place) { return region.has(place); }));
}

// Whether enough of the wheels' places lie on either floor.
template <typename Region>
bool parts(const std::vector<Vector2d>& places, const std::vector<FitRow>& rows,
           const VectorXd& values) {
  const Region region(rows, values);
  const double there = places_there(places, region), all = static_cast<double>(places.size());
  const double fewer = std::min(there, all - there);
  return region.may_be(places) && fewer > std::max(kLeastInside * all, kLeastPlaces);
}

// Values of the best of some borders, the best of every group climbed from.  `rows` are those of
// the fit and behind them the region's, its ratio last.
template <typename Region>
VectorXd best_region(const WindowFitter& fitter, const WindowFit& fit,
                     const std::vector<FitRow>& rows, const VectorXd& values,
                     const std::vector<Starts>& groups) {
  const std::vector<Vector2d> places = wheel_places(fitter);
  const Eigen::Index ratio = values.size() - 1;
  const double differs = is_throttled(fitter.robot()) ? kThrottleTried : 1;
  // Where both floors are one, nothing depends on where the border is.
  WindowFit one = fit;
  one.rows.assign(rows.begin(), rows.end() - 1);
  std::vector<Eigen::MatrixXd> slopes = fitter.slopes(fit);
  for (Eigen::MatrixXd& J : slopes) {
    J.conservativeResize(3, ratio);
    J.rightCols(ratio - fit.values.size()).setZero();
  }
  std::vector<std::pair<double, VectorXd>> best_of_group;
  for (const Starts& group : groups) {
    auto& best = best_of_group.emplace_back(-std::numeric_limits<double>::infinity(), values);
    const auto offer = [&](double gain, const VectorXd& start) {
      if (gain > best.first) best = {gain, start};
    };
    for (VectorXd start : group) {
      if (!parts<Region>(places, rows, start)) continue;
      one.values = start.head(ratio);
      offer(fitter.promise(one, slopes, rows, start), start);
      // Windows over a border are outliers of one floor, so that slopes there promise too little.
      for (const double tried : Region::kTried) {
        start[ratio] = 1 + differs * (tried - 1);
        offer(fitter.hold(rows, start).objective - fit.objective, start);
      }
    }
  }
  std::ranges::sort(best_of_group, [](const auto& a, const auto& b) { return a.first > b.first; });
  VectorXd best = values;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < std::min(kClimbed, best_of_group.size()); ++k) {
    const auto& [gain, start] = best_of_group[k];
    if (!std::isfinite(gain)) break;
    // Nothing may draw a border away from there while both floors are one.
    std::vector<FitRow> from_there = rows;
    for (Eigen::Index r = fit.values.size(); r < ratio; ++r) {
      from_there[static_cast<std::size_t>(r)].row.nominal = start[r];
    }
    const WindowFit climbed = fitter.fit(from_there, {}, start, kClimbingRounds);
    if (!parts<Region>(places, rows, climbed.values)) continue;
    // The robot's own values are those of the floor that most of the log was driven on, unless the
    // log distinguishes.
    const double there = places_there(places, Region(rows, climbed.values));
    const bool own = 2 * there < static_cast<double>(places.size());
    const double likely = climbed.objective + (own ? kNotDistinguished : 0);
    if (likely <= most) continue;
    most = likely;
    best = climbed.values;
  }
  return best;
}

// A region gains nothing where all windows lie on one side, which is another floor; and no more
// than it does where every run has a share of its travel of its own, too: of runs that last as
// long, those that get beyond a line are the fast ones.
template <typename Region>
double gain_of_region(const WindowFitter& fitter, const WindowFit& with, const WindowFit& without) {
  if (!parts<Region>(wheel_places(fitter), with.rows, with.values)) return 0;
  return std::min(with.objective - without.objective,
                  fitter.within_runs(with).objective - fitter.within_runs(without).objective);
}

VectorXd scan_lines(const WindowFitter& fitter, const WindowFit& fit,
                    const std::vector<FitRow>& rows, const VectorXd& values) {
  const std::vector<Vector2d> places = wheel_places(fitter);
  std::vector<Starts> groups;
  for (int a = 0; a < kAngles; ++a) {
    const double angle = 2 * std::numbers::pi * a / kAngles;
    const std::vector<double> distances = along(places, direction_of(angle));
    Starts& group = groups.emplace_back();
    for (const double share : kShares) {
      VectorXd& start = group.emplace_back(values);
      start.tail<3>() << angle, at_share(distances, share), 1;
    }
  }
  return best_region<Line>(fitter, fit, rows, values, groups);
}

VectorXd scan_circles(const WindowFitter& fitter, const WindowFit& fit,
                      const std::vector<FitRow>& rows, const VectorXd& values) {
  const std::vector<Vector2d> places = wheel_places(fitter);
  const std::vector<double> xs = along(places, {1, 0}), ys = along(places, {0, 1});
  const double scatter = scatter_of(places);
  std::vector<Starts> groups;
  for (const double x : kMiddles) {
    for (const double y : kMiddles) {
      Starts& group = groups.emplace_back();
      for (const double radius : kRadii) {
        VectorXd& start = group.emplace_back(values);
        start.tail<4>() << at_share(xs, x), at_share(ys, y), radius * scatter, 1;
      }
    }
  }
  return best_region<Circle>(fitter, fit, rows, values, groups);
}

// By what two floors differ: how much less far wheels travel on the other one, or how much harder,
// of its weight, it is for a throttle to roll the robot there.
struct Differs {
  bool throttled;

  Estimate operator()(double ratio) const {
    return throttled ? Estimate{"resistance", 1 - ratio, 0, 0, "-"}
                     : Estimate{"ratio", ratio - 1, 0, 0, "-"};
  }
  std::string text(const Estimate& e) const {
    const double sign = std::copysign(100, e.value);
    const auto [lo, hi] = std::minmax({sign * e.lo, sign * e.hi});
    const std::string share = fmt::format("{0:.{3}f} % [{1:.{3}f}, {2:.{3}f}]", sign * e.value, lo,
                                          hi, throttled ? 1 : 0);
    if (!throttled) return "travel " + share + (e.value < 0 ? " less far" : " farther");
    return "resist rolling by " + share + " of the weight " + (e.value > 0 ? "more" : "less");
  }
};

// How much slower the slower side is, where the line passes nearest to the middle of the log, and
// which side that is.
void describe_floor_edge(const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed,
                         NamedEffect* effect) {
  const Line line(fit.rows, fit.values);
  // The normal points to the slower side.
  const bool slower_beyond = line.ratio < 1;
  const double sign = slower_beyond ? 1 : -1, turn = slower_beyond ? 0 : std::numbers::pi;
  const double angle = wrap_angle(line.angle + turn);
  const Vector2d middle = fitter.windows().origin_m;
  const Differs differs{is_throttled(fitter.robot())};
  const std::vector<Estimate> found =
      derived_estimates(fitter, fit, seed, [&](const VectorXd& values) {
        const Line at(fit.rows, values);
        const double offset = at.offset - direction_of(at.angle).dot(middle - fitter.origin_m());
        return std::vector<Estimate>{
            differs(slower_beyond       ? at.ratio
                    : differs.throttled ? 2 - at.ratio
                                        : 1 / at.ratio),
            {"offset", sign * offset, 0, 0, "m"},
            {"angle", angle + wrap_angle(at.angle + turn - angle), 0, 0, "rad"}};
      });
  const Estimate &ratio = found[0], &offset = found[1], &normal = found[2];
  // The interval of the line's place is across it.
  const auto place = [&](const char* key, double from, double part) {
    const double ends[] = {from + offset.lo * part, from + offset.hi * part};
    return Estimate{key, from + offset.value * part, std::min(ends[0], ends[1]),
                    std::max(ends[0], ends[1]), "m"};
  };
  const Estimate x = place("x", middle[0], std::cos(angle));
  const Estimate y = place("y", middle[1], std::sin(angle));
  effect->parameters = {ratio, x, y, normal};
  effect->text = fmt::format(
      "The robot drives over an edge between two floors: its wheels {} beyond a line through x "
      "{:.3f} m [{:.3f}, {:.3f}], y {:.3f} m [{:.3f}, {:.3f}] of the tracker's frame; the slower "
      "side lies towards {:.0f} degrees [{:.0f}, {:.0f}] from its x axis.",
      differs.text(ratio), x.value, x.lo, x.hi, y.value, y.lo, y.hi, normal.value / kDegree,
      normal.lo / kDegree, normal.hi / kDegree);
}

void describe_friction_patch(const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed,
                             NamedEffect* effect) {
  const Differs differs{is_throttled(fitter.robot())};
  effect->parameters = derived_estimates(fitter, fit, seed, [&](const VectorXd& values) {
    const Circle at(fit.rows, values);
    const Vector2d middle = fitter.origin_m() + at.middle;
    return std::vector<Estimate>{differs(at.ratio),
                                 {"x", middle[0], 0, 0, "m"},
                                 {"y", middle[1], 0, 0, "m"},
                                 {"radius", at.radius, 0, 0, "m"}};
  });
  const auto text = [](const Estimate& e) {
    return fmt::format("{:.3f} m [{:.3f}, {:.3f}]", e.value, e.lo, e.hi);
  };
  const std::vector<Estimate>& e = effect->parameters;
  effect->text = fmt::format(
      "The robot drives over a patch of another floor: its wheels {} within {} of x {}, y {} of "
      "the "
      "tracker's frame.",
      differs.text(e[0]), text(e[3]), text(e[1]), text(e[2]));
}

GroundHypothesis region(const char* name, const char* alias, const char* thing,
                        std::vector<KinematicRow> freed) {
  GroundHypothesis hypothesis;
  hypothesis.name = name;
  hypothesis.aliases = {alias};
  hypothesis.thing = thing;
  hypothesis.price = kPriceOfLooking;
  hypothesis.freed = std::move(freed);
  hypothesis.of_world = true;
  hypothesis.kept = kKeptFloorShare;
  return hypothesis;
}

}  // namespace

GroundHypothesis floor_edge() {
  GroundHypothesis edge = region("floor_edge", "friction_patch", "the floor beyond a line",
                                 {{"edge_angle", 0, 0.2, "angle", "rad"},
                                  {"edge_offset", 0, 0.2, "offset", "m"},
                                  {"edge_ratio", 1, 0.02, "ratio", "-"}});
  edge.describe = describe_floor_edge;
  edge.propose = scan_lines;
  edge.gain = gain_of_region<Line>;
  return edge;
}

GroundHypothesis friction_patch() {
  GroundHypothesis patch = region("friction_patch", "floor_edge", "the floor within a circle",
                                  {{"patch_x", 0, 0.2, "x", "m"},
                                   {"patch_y", 0, 0.2, "y", "m"},
                                   {"patch_radius", 0, 0.2, "radius", "m", true},
                                   {"patch_ratio", 1, 0.02, "ratio", "-"}});
  patch.describe = describe_friction_patch;
  patch.propose = scan_circles;
  patch.gain = gain_of_region<Circle>;
  return patch;
}

}  // namespace gapfarm
