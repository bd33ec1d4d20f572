#include "master/ground/fit/edge.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/constants.h"
#include "master/ground/fit/held_out.h"
#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

// Lines that are looked at: normals 15 degrees apart, over half a turn since the other half is the
// same lines with inverse ratios; at each those with these shares of the wheels' places before
// them.
constexpr int kAngles = 12;
constexpr double kShares[] = {0.03, 0.06, 0.12, 0.22, 0.35, 0.5, 0.65, 0.78, 0.88, 0.94, 0.97};
constexpr double kLeastSide = 0.015;           // of the wheels' places, on the smaller side
constexpr double kTried[] = {0.75, 1 / 0.75};  // ratios, as of two floors that differ clearly
constexpr std::size_t kClimbed = 4;            // of the angles, each from its best line

struct EdgeRows {
  Eigen::Index ratio, angle, offset;
};

EdgeRows edge_rows(const std::vector<FitRow>& rows) {
  return {row_index(rows, "edge_ratio"), row_index(rows, "edge_angle"),
          row_index(rows, "edge_offset")};
}

double along_normal(const Pose& X, double angle) {
  return X.x * std::cos(angle) + X.y * std::sin(angle);
}

// How far wheels stand along a normal where windows begin, ascending.
std::vector<double> places_along(const WindowFitter& fitter, double angle) {
  const Pose X_MR = inverse(fitter.robot().X_RM);
  std::vector<double> places;
  for (const Trial& trial : fitter.windows().trials) {
    for (const RobotWheel& wheel : fitter.robot().wheels) {
      if (!wheel.driven) continue;
      const Pose X_RP{wheel.x_m.value_or(0), wheel.y_m.value_or(0), 0};
      places.push_back(along_normal(trial.X_WS * X_MR * X_RP, angle));
    }
  }
  std::sort(places.begin(), places.end());
  return places;
}

// Whether enough of the windows lie on either side of a fit's line.
bool parts_windows(const WindowFitter& fitter, const WindowFit& fit) {
  const EdgeRows at = edge_rows(fit.rows);
  if (at.angle < 0 || !(fit.values[at.ratio] > 0)) return false;
  const std::vector<double> places = places_along(fitter, fit.values[at.angle]);
  const auto beyond = std::lower_bound(places.begin(), places.end(), fit.values[at.offset]);
  const double share =
      static_cast<double>(beyond - places.begin()) / static_cast<double>(places.size());
  return std::min(share, 1 - share) > kLeastSide;
}

// Parameters and text of a named edge: how much less far wheels travel on the slower side, where
// the line passes nearest to the middle of the log, and which side is slower.
void describe_floor_edge(const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed,
                         NamedEffect* effect) {
  const EdgeRows at = edge_rows(fit.rows);
  const std::vector<Trial>& trials = fitter.windows().trials;
  Pose middle;
  for (const Trial& trial : trials) {
    middle.x += trial.X_WS.x / static_cast<double>(trials.size());
    middle.y += trial.X_WS.y / static_cast<double>(trials.size());
  }
  // The normal points to the slower side.
  const bool slower_beyond = fit.values[at.ratio] < 1;
  const double turn = slower_beyond ? 0 : std::numbers::pi;
  const double angle = wrap_angle(fit.values[at.angle] + turn);
  const auto change_of = [&](double ratio) { return (slower_beyond ? ratio : 1 / ratio) - 1; };
  const auto offset_of = [&](double a, double offset) {
    return (slower_beyond ? 1 : -1) * (offset - along_normal(middle, a));
  };
  const auto line_of = [&](const Eigen::VectorXd& v) {
    return Eigen::Vector3d(change_of(v[at.ratio]), offset_of(v[at.angle], v[at.offset]),
                           angle + wrap_angle(v[at.angle] + turn - angle));
  };
  // Slopes at the line know the windows over it alone: what moves it more is that others are.
  const std::vector<WindowFit> folds = fit_without_folds(fitter, fit.rows, fit.values);
  Eigen::Matrix3Xd parts(3, kFolds);
  for (int k = 0; k < kFolds; ++k) parts.col(k) = line_of(folds[k].values);
  const Eigen::Vector3d line = line_of(fit.values), deviation = jackknife_deviation(parts);
  const Eigen::MatrixXd draws = fitter.draws(fit, seed);
  const auto estimate = [&](const char* key, Eigen::Index row, const char* unit) {
    std::vector<double> drawn;
    for (const auto& values : draws.colwise()) drawn.push_back(line_of(values)[row]);
    return widened_estimate(key, line[row], std::move(drawn), deviation[row], unit);
  };
  const Estimate ratio = estimate("ratio", 0, "-");
  const Estimate offset = estimate("offset", 1, "m");
  const Estimate normal = estimate("angle", 2, "rad");
  // The interval of the line's place is across it.
  const auto place = [&](const char* key, double from, double part) {
    const double ends[] = {from + offset.lo * part, from + offset.hi * part};
    return Estimate{key, from + offset.value * part, std::min(ends[0], ends[1]),
                    std::max(ends[0], ends[1]), "m"};
  };
  const Estimate x = place("x", middle.x, std::cos(angle));
  const Estimate y = place("y", middle.y, std::sin(angle));
  effect->parameters = {ratio, x, y, normal};
  effect->text = fmt::format(
      "The robot drives over an edge between two floors: its wheels travel {:.0f} % [{:.0f}, "
      "{:.0f}] less far beyond a line through x {:.3f} m [{:.3f}, {:.3f}], y {:.3f} m [{:.3f}, "
      "{:.3f}] of the tracker's frame; the slower side lies towards {:.0f} degrees [{:.0f}, "
      "{:.0f}] from its x axis.",
      -100 * ratio.value, -100 * ratio.hi, -100 * ratio.lo, x.value, x.lo, x.hi, y.value, y.lo,
      y.hi, normal.value / kDegree, normal.lo / kDegree, normal.hi / kDegree);
}

}  // namespace

GroundHypothesis floor_edge() {
  GroundHypothesis edge;
  edge.name = kFloorEdge;
  edge.aliases = {"friction_patch"};
  edge.thing = "the floor beyond a line";
  edge.freed = {{"edge_angle", 0, 0.2, "angle", "rad"},
                {"edge_offset", 0, 0.2, "offset", "m"},
                {"edge_ratio", 1, 0.02, "ratio", "-"}};
  edge.price = kPriceOfAnEdge;
  edge.of_world = true;
  edge.describe = describe_floor_edge;
  return edge;
}

Eigen::VectorXd scan_floor_edge(const WindowFitter& fitter, const WindowFit& fit,
                                const std::vector<FitRow>& rows, const Eigen::VectorXd& values) {
  const EdgeRows at = edge_rows(rows);
  // Where both floors are one, nothing depends on where the line is.
  WindowFit one = fit;
  one.rows.assign(rows.begin(), rows.end() - 1);
  std::vector<Eigen::MatrixXd> slopes = fitter.slopes(fit);
  for (Eigen::MatrixXd& J : slopes) {
    J.conservativeResize(3, J.cols() + 2);
    J.rightCols(2).setZero();
  }
  std::vector<std::pair<double, Eigen::VectorXd>> lines;  // the best of each angle
  for (int a = 0; a < kAngles; ++a) {
    const double angle = std::numbers::pi * a / kAngles;
    const std::vector<double> places = places_along(fitter, angle);
    lines.emplace_back(-std::numeric_limits<double>::infinity(), values);
    const auto offer = [&](double gain, const Eigen::VectorXd& start) {
      if (gain > lines.back().first) lines.back() = {gain, start};
    };
    for (const double share : kShares) {
      Eigen::VectorXd start = values;
      start[at.ratio] = 1;
      start[at.angle] = angle;
      start[at.offset] =
          places[static_cast<std::size_t>(share * static_cast<double>(places.size() - 1))];
      one.values = start.head(start.size() - 1);
      offer(fitter.promise(one, slopes, rows, start), start);
      // Windows over an edge are outliers of one floor, so that slopes there promise too little.
      for (const double ratio : kTried) {
        start[at.ratio] = ratio;
        offer(fitter.hold(rows, start).objective - fit.objective, start);
      }
    }
  }
  std::ranges::sort(lines, [](const auto& a, const auto& b) { return a.first > b.first; });
  Eigen::VectorXd best = values;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < std::min(kClimbed, lines.size()); ++k) {
    const WindowFit climbed = fitter.fit(rows, {}, lines[k].second, 6);
    if (climbed.objective <= most || !parts_windows(fitter, climbed)) continue;
    most = climbed.objective;
    best = climbed.values;
  }
  return best;
}

double gain_of(const WindowFitter& fitter, const GroundHypothesis& hypothesis,
               const WindowFit& with, const WindowFit& without) {
  double gain = with.objective - without.objective;
  if (hypothesis.name == kFloorEdge) {
    if (!parts_windows(fitter, with)) return 0;
    gain =
        std::min(gain, fitter.within_runs(with).objective - fitter.within_runs(without).objective);
  }
  return gain - hypothesis.price;
}

}  // namespace gapfarm
