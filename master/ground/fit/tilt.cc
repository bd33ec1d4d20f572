#include "master/ground/fit/tilt.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <string>

#include "common/base/constants.h"
#include "common/pose/pose.h"
#include "master/ground/fit/held_out.h"
#include "master/ground/tolerances.h"

namespace gapfarm {

namespace {

// How much farther the robot goes downhill, and where that is.
void describe_floor_tilt(const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed,
                         NamedEffect* effect) {
  const Eigen::Index x = row_index(fit.rows, "downhill_x"), y = row_index(fit.rows, "downhill_y");
  const auto downhill = [&](const auto& values) {
    return Eigen::Vector2d(values[x] - fit.rows[x].row.nominal,
                           values[y] - fit.rows[y].row.nominal);
  };
  const Eigen::Vector2d down = downhill(fit.values);
  const double angle = std::atan2(down[1], down[0]);
  // Along what was found: lengths of vectors that are unsure are too long.
  const auto polar = [&](const Eigen::Vector2d& v) {
    return Eigen::Vector2d(v.dot(down) / down.norm(),
                           angle + wrap_angle(std::atan2(v[1], v[0]) - angle));
  };
  std::vector<double> shares, angles;
  const Eigen::MatrixXd draws = fitter.draws(fit, seed);
  for (const auto& values : draws.colwise()) {
    const Eigen::Vector2d drawn = polar(downhill(values));
    shares.push_back(drawn[0]);
    angles.push_back(drawn[1]);
  }
  // How a slope moves a robot is motors' and contacts' own, no share of its way to the digit: parts
  // of the log differ by more than their noise.
  const std::vector<WindowFit> folds = fit_without_folds(fitter, fit.rows, fit.values);
  Eigen::MatrixXd parts(2, kFolds);
  for (int k = 0; k < kFolds; ++k) parts.col(k) = polar(downhill(folds[k].values));
  const Eigen::VectorXd deviation = jackknife_deviation(parts);
  const Estimate share =
      widened_estimate("share", down.norm(), std::move(shares), deviation[0], "-");
  const Estimate way = widened_estimate("direction", angle, std::move(angles), deviation[1], "rad");
  effect->parameters = {share, way};
  const std::string farther =
      fmt::format("{:.1f} % [{:.1f}, {:.1f}]", 100 * share.value, 100 * share.lo, 100 * share.hi);
  effect->text = fmt::format(
      "The floor falls away towards {:.0f} degrees [{:.0f}, {:.0f}] from the tracker's x axis: {}.",
      angle / kDegree, way.lo / kDegree, way.hi / kDegree,
      skids(fitter.robot())
          ? "turns slide that way by " + farther + " of how far they drag the wheels"
          : "that way the robot goes " + farther + " farther than its wheels roll");
}

}  // namespace

GroundHypothesis floor_tilt() {
  GroundHypothesis tilt;
  tilt.name = "floor_tilt";
  tilt.thing = "the floor's slope";
  tilt.freed = {{"downhill_x", 0, kDownhillShare, "x", "-"},
                {"downhill_y", 0, kDownhillShare, "y", "-"}};
  tilt.price = kPriceOfAValue;
  tilt.of_world = true;
  tilt.describe = describe_floor_tilt;
  return tilt;
}

}  // namespace gapfarm
