#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "master/ground/hypotheses.h"
#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

double reach_of(const GroundRobot& robot) { return std::max(wheel_reach_m(robot), 1e-3); }

}  // namespace

double least_value(const KinematicRow& row) {
  if (row.positive) return 0;
  return row.key == "ratio" ? kLeastRatio * row.nominal : -std::numeric_limits<double>::infinity();
}

double plausible_error(const KinematicRow& row) {
  for (const PlausibleError& error : kPlausibleErrors) {
    if (row.name == error.row) return std::max(error.deviation, row.tolerance);
  }
  return kPlausibleTolerances * row.tolerance;
}

std::vector<KinematicRow> kinematic_rows(const GroundRobot& robot) {
  std::vector<KinematicRow> rows;
  const double reach = reach_of(robot);
  if (is_holonomic(robot)) {
    rows = {{"ahead", 1, kGainShare, "ratio", "-"},
            {"aside", 1, kGainShare, "ratio", "-"},
            {"turn", 1, kGainShare, "ratio", "-"},
            {"traction", 1, kGainShare, "ratio", "-"},
            {"load_x", robot.com_x_m.value_or(0), kLoadShare * reach, "x", "m", false, reach},
            {"load_y", robot.com_y_m.value_or(0), kLoadShare * reach, "y", "m", false, reach}};
  } else if (is_steered(robot)) {
    const double slow = robot.steering.understeer_s2_m2;
    rows = {{"steering_offset", 0, kSteering_rad, "angle", "rad"},
            {"steering_gain", 1, kSteeringGainShare, "ratio", "-"},
            {"understeer", slow, 0.01 + 0.2 * slow, "understeer", "s^2/m^2"}};
    if (is_throttled(robot)) {
      const RobotThrottle& t = robot.throttle;
      const auto put = [&](const char* name, double own, double least, const char* unit) {
        rows.push_back({name, own, least + kPowerShare * own, name, unit, true});
      };
      put("gain", t.gain, 0, "m/s^2");
      put("zero", t.zero, 0.003, "-");
      put("back_emf", t.back_emf, 0.05, "1/s");
      put("drag", t.drag, 0.02, "1/s");
      put("coulomb", t.coulomb, 0.02, "m/s^2");
      put("cornering", t.cornering, 0.02, "-");
    } else {
      rows.push_back({"ahead", 1, kRadiusShare, "ratio", "-"});
    }
  } else {
    const double radius = skids(robot) ? kSkidRadiusShare : kRadiusShare;
    const double separation = skids(robot) ? kSkidSeparationShare : kSeparationShare;
    rows = {{"left", 1, radius, "ratio", "-"},
            {"right", 1, radius, "ratio", "-"},
            {"separation", 1, separation, "ratio", "-"}};
  }
  const bool car = robot.drive == DriveKind::kAckermann;
  const double marker = (car ? kCarMarkerShare : kMarkerShare) * reach;
  const Pose& X = robot.X_RM;
  rows.push_back({"lag", robot.motors.lag_s, kLag_s, "tau", "s", true});
  rows.push_back({"delay", robot.motors.delay_s, kDelay_s, "latency", "s"});
  rows.push_back({"marker_x", X.x, marker, "x", "m"});
  rows.push_back({"marker_y", X.y, marker, "y", "m"});
  rows.push_back({"marker_yaw", X.theta, car ? kCarMarkerYaw_rad : kMarkerYaw_rad, "angle", "rad"});
  return rows;
}

std::vector<KinematicRow> change_rows(const GroundRobot& robot) {
  // Whatever is a size stays: what the floor or hands change is asked for.
  const std::map<std::string, double> kept = {{"left", kSlipShare},
                                              {"right", kSlipShare},
                                              {"ahead", kSlipShare},
                                              {"separation", kKeptTurnShare},
                                              {"aside", kKeptTurnShare},
                                              {"turn", kKeptTurnShare},
                                              {"traction", kKeptTractionShare},
                                              {"steering_gain", kKeptTurnShare}};
  std::vector<KinematicRow> rows = kinematic_rows(robot);
  for (KinematicRow& row : rows) {
    if (const auto found = kept.find(row.name); found != kept.end()) row.tolerance = found->second;
    if (row.name == "marker_x" || row.name == "marker_y") {
      row.tolerance = kMarkerShare * reach_of(robot);
    }
    if (row.name == "marker_yaw") row.tolerance = kMarkerYaw_rad;
  }
  if (!is_steered(robot)) return rows;
  const double held_m_s2 = robot.friction * robot.friction_ratio * kGravity_m_s2;
  rows.push_back({"grip", std::log(held_m_s2), kGripShare, "log", "-"});
  rows.push_back({"slip_angle", kSlipAngle_rad, kKeptSlipAngle_rad, "angle", "rad"});
  rows.push_back({"grip_shape", std::log(2.0), kKeptGripShape, "shape", "-"});
  return rows;
}

}  // namespace gapfarm
