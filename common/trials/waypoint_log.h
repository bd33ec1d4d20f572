// blendersim's way-point logs: where a robot was seen and where it was sent.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/trials/trial.h"

namespace gapfarm {

struct WaypointLog {
  std::vector<PathSample> path;          // camera poses from the first order on, t_s since then
  std::vector<Eigen::Vector2d> targets;  // m, in the order in which the robot made for them
};

// Lines "HH:MM:SS:mmm:uuu [ SENT ] CAMPOSE id x y theta ..." (whole centimetres, radians) and
// "... WAYPOINTS id n x1 y1 ...", the way-points still ahead; the first of them is the target, and
// "1 0 0" is none.  Times may pass midnight once.  Errors name the line; also no target or no pose
// after the first.
Result<WaypointLog> parse_waypoint_log(std::string_view text, const std::string& file);
Result<WaypointLog> read_waypoint_log(const std::string& file);

}  // namespace gapfarm
