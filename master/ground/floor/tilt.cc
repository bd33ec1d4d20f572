#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/constants.h"
#include "common/pose/pose.h"
#include "master/ground/fit/held_out.h"
#include "master/ground/hypotheses.h"
#include "master/ground/tolerances.h"

namespace gapfarm {

namespace {

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
    return fmt::format("{:.1f} {} [{:.1f}, {:.1f}]", scale * size.value, unit, scale * size.lo,
                       scale * size.hi);
  };
  effect->text = fmt::format(
      "The floor falls away towards {:.0f} degrees [{:.0f}, {:.0f}] from the tracker's x axis: {}.",
      angle / kDegree, way.lo / kDegree, way.hi / kDegree,
      throttled ? "by " + sized("degrees", 1 / kDegree)
      : skids(fitter.robot())
          ? "turns slide that way by " + sized("%", 100) + " of how far they drag the wheels"
          : "that way the robot goes " + sized("%", 100) + " farther than its wheels roll");
}

}  // namespace

GroundHypothesis floor_tilt() {
  GroundHypothesis tilt;
  tilt.name = "floor_tilt";
  tilt.thing = "the floor's slope";
  tilt.freed = {{"downhill_x", 0, kDownhillShare, "x", "-"},
                {"downhill_y", 0, kDownhillShare, "y", "-"}};
  tilt.of_world = true;
  tilt.describe = describe_floor_tilt;
  return tilt;
}

}  // namespace gapfarm
