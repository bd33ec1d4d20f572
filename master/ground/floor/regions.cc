// Floors that are not the same or not level all over.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/constants.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "master/ground/fit/held_out.h"
#include "master/ground/fit/scans.h"
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
constexpr double kFarRadii[] = {0.7, 1, 1.4};  // the same round windows that miss far
constexpr double kLeastPlaces = 3 * kFolds;    // so that each fold has some to be predicted
constexpr double kThrottleTried = 0.2;         // of the tried ratios: 5 % of the weight, a carpet
constexpr std::size_t kClimbed = 4;            // of the groups, each from its best
constexpr int kClimbingRounds = 6;

using Eigen::Vector2d, Eigen::VectorXd;
using Starts = std::vector<VectorXd>;

// The places' distances along a direction, ascending.
std::vector<double> along(const std::vector<Vector2d>& places, const Vector2d& direction) {
  auto distances = mapped(places, [&](const Vector2d& place) { return place.dot(direction); });
  std::ranges::sort(distances);
  return distances;
}

double at_share(const std::vector<double>& ascending, double share) {
  return ascending[static_cast<std::size_t>(share * static_cast<double>(ascending.size() - 1))];
}

Vector2d direction_of(double angle) { return {std::cos(angle), std::sin(angle)}; }

double value_of(const std::vector<FitRow>& rows, const VectorXd& values, std::string_view name) {
  return values[row_index(rows, name)];
}

// A part of the floor, by the rows that are named after it.
struct Region {
  std::string name;
  // Ratios that are tried beside what slopes promise, as of two floors that differ clearly.  Lines
  // are looked at from either side.
  std::vector<double> tried;

  double ratio(const std::vector<FitRow>& rows, const VectorXd& values) const {
    return value_of(rows, values, name + "_ratio");
  }
};
const Region kEdge = {"edge", {0.75}}, kPatch = {"patch", {0.75, 1 / 0.75}};

// How many of the wheels' places lie on the region's floor.
double places_there(const std::vector<Vector2d>& places, const Region& region,
                    const std::vector<FitRow>& rows, const VectorXd& values) {
  FloorParts floor({0, 0});
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const std::string& name = rows[k].row.name;
    const bool is_ratio = name.ends_with("_ratio");
    if (name.starts_with(region.name + "_")) floor.put(name, is_ratio ? 2 : values[k]);
  }
  const RobotWheel wheel;
  return static_cast<double>(std::ranges::count_if(places, [&](const Vector2d& place) {
    const RobotPlace at{place};
    return floor.under(&at, wheel) > 1.5;  // beyond the middle of the border
  }));
}

// Whether enough of the wheels' places lie on either floor.
bool parts(const std::vector<Vector2d>& places, const Region& region,
           const std::vector<FitRow>& rows, const VectorXd& values) {
  if (region.ratio(rows, values) <= 0) return false;
  // One that is larger than the log reaches is an edge.
  const Eigen::Index radius = row_index(rows, region.name + "_radius");
  if (radius >= 0 && values[radius] >= kLargestPatch * scatter_of(places)) return false;
  const double there = places_there(places, region, rows, values);
  const auto all = static_cast<double>(places.size());
  return std::min(there, all - there) > std::max(kLeastInside * all, kLeastPlaces);
}

// parts() of a fit's values.
auto parted_by(const Region& region, const WindowFitter& fitter, const WindowFit& fit) {
  return [&, places = wheel_places(fitter)](const VectorXd& values) {
    return parts(places, region, fit.rows, values);
  };
}

// Values of the best of some borders, the best of every group climbed from.  `rows` are those of
// the fit and behind them the region's, its ratio last.
VectorXd best_region(const Region& region, const WindowFitter& fitter, const WindowFit& fit,
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
      if (!parts(places, region, rows, start)) continue;
      one.values = start.head(ratio);
      offer(fitter.promise(one, slopes, rows, start), start);
      // Windows over a border are outliers of one floor, so that slopes there promise too little.
      for (const double tried : region.tried) {
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
      from_there[r].row.nominal = start[r];
    }
    const WindowFit climbed = fitter.fit(from_there, {}, start, kClimbingRounds);
    if (!parts(places, region, rows, climbed.values)) continue;
    // The robot's own values are those of the floor that most of the log was driven on, unless the
    // log distinguishes.
    const double there = places_there(places, region, rows, climbed.values);
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
auto gain_of_region(const Region& region) {
  return [&region](const WindowFitter& fitter, const WindowFit& with, const WindowFit& without) {
    if (!parts(wheel_places(fitter), region, with.rows, with.values)) return 0.0;
    return std::min(with.objective - without.objective,
                    fitter.within_runs(with).objective - fitter.within_runs(without).objective);
  };
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
  return best_region(kEdge, fitter, fit, rows, values, groups);
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
  // What is driven over rarely makes outliers, which no circle that lies a little off explains.
  if (const auto far = wheel_places(fitter, &fit); far.size() >= kFewestReadings) {
    const double middle[] = {at_share(along(far, {1, 0}), 0.5), at_share(along(far, {0, 1}), 0.5)};
    for (const double times : kFarRadii) {
      VectorXd& start = groups.emplace_back().emplace_back(values);
      start.tail<4>() << middle[0], middle[1], times * scatter_of(far), 1;
    }
  }
  return best_region(kPatch, fitter, fit, rows, values, groups);
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
    const std::string share =
        with_interval(throttled ? "%.1f" : "%.0f", sign * e.value, lo, hi, "%");
    if (!throttled) return "travel " + share + (e.value < 0 ? " less far" : " farther");
    return "resist rolling by " + share + " of the weight " + (e.value > 0 ? "more" : "less");
  }
};

std::string metres_text(const Estimate& e) {
  return with_interval("%.3f", e.value, e.lo, e.hi, "m");
}

// How much slower the slower side is, where the line passes nearest to the middle of the log, and
// which side that is.
void describe_floor_edge(const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed,
                         NamedEffect* effect) {
  // The normal points to the slower side.
  const bool slower_beyond = kEdge.ratio(fit.rows, fit.values) < 1;
  const double sign = slower_beyond ? 1 : -1, turn = slower_beyond ? 0 : std::numbers::pi;
  const double angle = wrap_angle(value_of(fit.rows, fit.values, "edge_angle") + turn);
  const Vector2d middle = fitter.windows().origin_m;
  const Differs differs{is_throttled(fitter.robot())};
  const std::vector<Estimate> found = derived_estimates(
      fitter, fit, seed,
      [&](const VectorXd& values) {
        const double ratio = kEdge.ratio(fit.rows, values);
        const double normal = value_of(fit.rows, values, "edge_angle");
        const double offset = value_of(fit.rows, values, "edge_offset") -
                              direction_of(normal).dot(middle - fitter.origin_m());
        return std::vector<Estimate>{
            differs(slower_beyond       ? ratio
                    : differs.throttled ? 2 - ratio
                                        : 1 / ratio),
            {"offset", sign * offset, 0, 0, "m"},
            {"angle", angle + wrap_angle(normal + turn - angle), 0, 0, "rad"}};
      },
      parted_by(kEdge, fitter, fit));
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
      "The robot drives over an edge between two floors: its wheels {} beyond a line through x {}, "
      "y {} of the tracker's frame; the slower side lies towards {} from its x axis.",
      differs.text(ratio), metres_text(x), metres_text(y),
      with_interval("%.0f", normal.value / kDegree, normal.lo / kDegree, normal.hi / kDegree,
                    "degrees"));
}

void describe_friction_patch(const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed,
                             NamedEffect* effect) {
  const Differs differs{is_throttled(fitter.robot())};
  effect->parameters = derived_estimates(
      fitter, fit, seed,
      [&](const VectorXd& values) {
        const auto of = [&](const char* name) { return value_of(fit.rows, values, name); };
        const Vector2d& origin = fitter.origin_m();
        return std::vector<Estimate>{differs(of("patch_ratio")),
                                     {"x", origin[0] + of("patch_x"), 0, 0, "m"},
                                     {"y", origin[1] + of("patch_y"), 0, 0, "m"},
                                     {"radius", of("patch_radius"), 0, 0, "m"}};
      },
      parted_by(kPatch, fitter, fit));
  effect->parameters[3].lo = std::max(effect->parameters[3].lo, 0.0);
  const std::vector<Estimate>& e = effect->parameters;
  effect->text = fmt::format(
      "The robot drives over a patch of another floor: its wheels {} within {} of x {}, y {} of "
      "the tracker's frame.",
      differs.text(e[0]), metres_text(e[3]), metres_text(e[1]), metres_text(e[2]));
}

// How much farther the robot goes downhill, or how steep that is, and where it is.
void describe_floor_tilt(const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed,
                         NamedEffect* effect) {
  const Eigen::Index x = row_index(fit.rows, "downhill_x"), y = row_index(fit.rows, "downhill_y");
  const auto downhill = [&](const Eigen::VectorXd& values) {
    return Eigen::Vector2d(values[x] - fit.rows[x].row.nominal,
                           values[y] - fit.rows[y].row.nominal);
  };
  const Eigen::Vector2d down = downhill(fit.values);
  const bool throttled = is_throttled(fitter.robot());
  const double angle = std::atan2(down[1], down[0]);
  // Along what was found: lengths of vectors that are unsure are too long.
  effect->parameters = derived_estimates(fitter, fit, seed, [&](const Eigen::VectorXd& values) {
    const Eigen::Vector2d v = downhill(values);
    const double way = angle + wrap_angle(std::atan2(v[1], v[0]) - angle);
    const double along = v.dot(down) / down.norm();
    return std::vector<Estimate>{
        throttled ? Estimate{"angle", std::asin(std::clamp(along, -1.0, 1.0)), 0, 0, "rad"}
                  : Estimate{"share", along, 0, 0, "-"},
        {"direction", way, 0, 0, "rad"}};
  });
  const Estimate& size = effect->parameters[0];
  const Estimate& way = effect->parameters[1];
  const auto sized = [&](const char* unit, double scale) {
    return with_interval("%.1f", scale * size.value, scale * size.lo, scale * size.hi, unit);
  };
  effect->text = fmt::format(
      "The floor falls away towards {:.0f} degrees [{:.0f}, {:.0f}] from the tracker's x axis: {}.",
      angle / kDegree, way.lo / kDegree, way.hi / kDegree,
      throttled ? "by " + sized("degrees", 1 / kDegree)
      : skids(fitter.robot())
          ? "turns slide that way by " + sized("%", 100) + " of how far they drag the wheels"
          : "that way the robot goes " + sized("%", 100) + " farther than its wheels roll");
}

GroundHypothesis region(const char* name, const char* alias, const char* thing,
                        std::vector<KinematicRow> freed) {
  GroundHypothesis hypothesis{name, {alias}, thing, std::move(freed)};
  hypothesis.price = kPriceOfLooking;
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
  edge.gain = gain_of_region(kEdge);
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
  patch.gain = gain_of_region(kPatch);
  return patch;
}

GroundHypothesis floor_tilt() {
  GroundHypothesis tilt{
      "floor_tilt",
      {},
      "the floor's slope",
      {{"downhill_x", 0, kDownhillShare, "x", "-"}, {"downhill_y", 0, kDownhillShare, "y", "-"}}};
  tilt.of_world = true;
  tilt.describe = describe_floor_tilt;
  return tilt;
}

}  // namespace gapfarm
