#include "master/ground/hypotheses.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "common/base/ranges.h"
#include "common/score/kinematic.h"
#include "master/ground/fit/scans.h"
#include "master/ground/fit/window_set.h"
#include "master/ground/tolerances.h"

namespace gapfarm {
namespace {

double reach_of(const GroundRobot& robot) { return std::max(wheel_reach_m(robot), 1e-3); }

// Whether driven wheels of a steered robot follow their commands with a lag of their own.
bool moves_later(const GroundRobot& robot) {
  return is_steered(robot) && !is_throttled(robot) &&
         (!robot.measured || robot.motors.drive_lag_s > 0);
}

// Of what does not depend on the fit that it is offered beside.
auto from_scan(Eigen::VectorXd (*scan)(const WindowFitter&, const std::vector<FitRow>&,
                                       const Eigen::VectorXd&)) {
  return [scan](const WindowFitter& fitter, const WindowFit&, const std::vector<FitRow>& rows,
                const Eigen::VectorXd& values) { return scan(fitter, rows, values); };
}

// Where there is none of it there is no slope to it either.
void only_more(GroundHypothesis& hypothesis) {
  hypothesis.freed.front().positive = true;
  hypothesis.propose = from_scan(scan_size);
}

// Of a robot's file, or of what may change from one log to another.
class Catalogue {
 public:
  Catalogue(const GroundRobot& robot, const std::vector<KinematicRow>& rows, bool changes)
      : all(wrong_log(robot)), robot_(robot), rows_(rows), changes_(changes) {
    if (changes) floors();
    sizes();
    if (!changes) all_sizes();
    steering();
    motors();
    marker();
    if (!changes) tracker();
    // Where on the floor, and which way.
    all.push_back(floor_edge());
    all.push_back(friction_patch());
    all.push_back(floor_tilt());
  }

  std::vector<GroundHypothesis> all;  // simple ones first

 private:
  const KinematicRow& row(const std::string& name) const {
    return *std::ranges::find(rows_, name, &KinematicRow::name);
  }
  GroundHypothesis& value(const std::string& name, std::vector<std::string> aliases,
                          const std::string& thing, std::vector<KinematicRow> freed) {
    all.push_back({name, std::move(aliases), thing, std::move(freed)});
    return all.back();
  }

  void sizes() {
    const double share = skids(robot_) ? kSkidRadiusShare : kRadiusShare;
    if (is_throttled(robot_)) return;
    if (is_holonomic(robot_)) {
      // Without a turn, wheels that are larger cannot be distinguished from rollers that drag less.
      if (!changes_) {
        value("wheel_radius", {"speed_gain"}, "the radius of all wheels",
              {{"travel", 1, share, "ratio", "-"}});
        for (const RobotWheel& w : robot_.wheels) {
          if (!w.driven) continue;
          value("wheel_radius", {"motor_asymmetry"}, "the radius of wheel " + w.name,
                {{radius_row(w), 1, share, "ratio", "-"}});
        }
      }
      value("wheel_slip", {"floor", "roller_drag"}, "how far the robot goes of its wheels' way",
            {row("traction")});
      value("com_offset", {"payload"}, "where the weight stands on the wheels",
            {row("load_x"), row("load_y")});
      value("ahead_gain", {"roller_drag", "speed_gain"}, "travel ahead", {row("ahead")});
      value("aside_gain", {"roller_drag"}, "travel aside", {row("aside")});
      value("wheel_separation", {"robot_radius", "turn_gain"},
            "how far the wheels stand from the middle",
            {{"arm", 1, row("turn").tolerance, "ratio", "-"}});
      return;
    }
    if (is_steered(robot_)) {
      value("wheel_radius", {"speed_gain"}, "the radius of the driving wheel", {row("ahead")});
      return;
    }
    value("wheel_radius", {"motor_asymmetry"}, "the radius of the right wheels", {row("right")});
    value("wheel_radius", {"motor_asymmetry"}, "the radius of the left wheels", {row("left")});
    value("wheel_radius", {"speed_gain"}, "the radius of all wheels",
          {{"travel", 1, share, "ratio", "-"}});
    value("wheel_separation", {"icr_track", "friction_anisotropy"},
          "the distance between the sides, as they roll", {row("separation")});
  }

  // A file that was made with a ruler is off in all of them; no robot changes so.
  void all_sizes() {
    if (is_throttled(robot_) || is_holonomic(robot_) || is_steered(robot_)) return;
    KinematicRow left = row("left"), right = row("right"), apart = row("separation");
    left.key = "left", right.key = "right", apart.key = "separation";
    value("wheel_radius", {"wheel_separation", "motor_asymmetry"}, "the size of the robot",
          {left, right, apart});
  }

  void steering() {
    if (!is_steered(robot_)) return;
    value("steering_offset", {}, "where the wheels point when commanded straight",
          {row("steering_offset")});
    value("steering_gain", {"wheelbase"}, "the angle that is steered over the commanded one",
          {row("steering_gain")});
    value("wheelbase", {"steering_gain"}, "the distance from the steered axle to the other",
          {{"wheelbase", 1, kSteeringGainShare, "ratio", "-"}});
    value("understeer", {"friction_anisotropy"}, "the loss of curvature with speed",
          {row("understeer")});
    value("steering_asymmetry", {"steering_gain"}, "the steering's gain to the left",
          {{"steering_left", 1, kSteeringGainShare, "ratio", "-"}});
    value("steering_asymmetry", {"steering_gain"}, "the steering's gain to the right",
          {{"steering_right", 1, kSteeringGainShare, "ratio", "-"}});
  }

  void motors() {
    value("command_delay", {"pose_latency", "clock_offset"}, "the time from a command to its pose",
          {row("delay")})
        .propose = from_scan(scan_delay);
    value("clock_drift", {"clock_offset"}, "the rate of one clock against the other",
          {{"drift", 0, 2e-5, "rate", "s/s"}});
    value("clock_drift", {"clock_offset"}, "the rate of the robot's clock against the tracker's",
          {{"rate", 0, 2e-5, "rate", "s/s"}});
    only_more(value("battery_sag", {}, "what the drive loses a minute",
                    {{"sag", 0, 0.005, "rate", "1/min"}}));
    // Motors lie before what was measured, unless the file states them all the same.
    if (!robot_.measured || robot_.motors.lag_s > 0) {
      value(is_steered(robot_) ? "steering_lag" : "motor_lag", {"motor_lag"},
            is_steered(robot_) ? "the lag of the steering" : "the lag of the wheels", {row("lag")});
    }
    if (moves_later(robot_)) {
      std::vector<std::string> aliases = {"acceleration_limit"};
      if (changes_) aliases.emplace_back("friction");  // tyres that spin as they speed up
      value("motor_lag", std::move(aliases), "the lag of the driven wheels", {row("drive_lag")});
    }
    if (is_throttled(robot_)) {
      value("throttle_gain", {"payload", "battery_voltage"}, "the acceleration a unit of throttle",
            {{"power", 1, kPowerShare, "ratio", "-"}});
      value("throttle_zero", {"motor_deadband"}, "the throttle that moves nothing", {row("zero")});
      value("rolling_resistance", {"drag"}, "the deceleration a m/s", {row("drag")});
      return;
    }
    if (!robot_.measured) {
      const double band = robot_.command == CommandKind::kWheelSpeeds ? 0.1 : 0.01;
      only_more(value("motor_deadband", {}, "commands that move nothing",
                      {{"dead_band", robot_.motors.dead_band, band, "width", "of the command"}}));
    }
    const auto& limit = robot_.motors.acceleration_limit_m_s2;
    if (robot_.measured && !limit) return;
    // Its tolerance depends on what is commanded (tolerate_ramps()); this is a step that shows.
    only_more(value("acceleration_limit", {"motor_lag"}, "the ramp of the wheels' speed",
                    {{"ramp", limit ? 1 / *limit : 0, 0.03, "ramp", "s^2/m"}}));
  }

  void marker() {
    const char* point = skids(robot_)
                            ? "the tracked point (or, by load or tyres, what the robot turns about)"
                            : "the tracked point on the robot";
    value("marker_offset", {"com_offset"}, point, {row("marker_x"), row("marker_y")});
    value("marker_yaw", {"heading_offset"}, "the heading of the tracked point",
          {row("marker_yaw")});
  }

  void tracker() {
    // Of increments alone a robot that is smaller in all its sizes shows as much.
    value("pose_scale", {"unit_error", "camera_scale"}, "the scale of all positions",
          {{"pose_scale", 1, 0.01, "ratio", "-"}})
        .of_world = true;
    value("camera_aspect", {}, "the scale of y over that of x", {{"aspect", 1, 0.01, "ratio", "-"}})
        .of_world = true;
  }

  // What another floor or another load changes.
  void floors() {
    const KinematicRow travel{"travel", 1, kSlipShare, "ratio", "-"};
    const char* slips = "how far the wheels travel a turn";
    if (is_steered(robot_)) {
      value("friction", {"friction_anisotropy"}, "friction across the wheels",
            {row("grip"), row("slip_angle"), row("grip_shape")})
          .propose = from_scan(scan_grip);
      if (!is_throttled(robot_))
        value("floor", {"wheel_slip", "wheel_radius"}, slips, {row("ahead")});
    } else if (skids(robot_)) {
      value("friction_across", {"wheel_separation", "icr_track", "friction_anisotropy"},
            "how hard the floor makes it to turn (the separation of the sides, as they roll)",
            {row("separation")});
      value("wheel_slip", {"wheel_radius", "speed_gain"}, slips, {travel});
      value("floor", {"wheel_slip", "friction_across"},
            "how the wheels slip:", {travel, row("separation")});
      // Weight to one side or end moves the point that wheels skid about, and makes them hold more.
      value("com_offset", {"payload", "marker_offset"},
            "where the weight stands, by what the robot turns about:",
            {row("marker_x"), row("marker_y"), row("separation")});
    } else if (is_holonomic(robot_)) {
      value("floor", {"wheel_slip", "roller_drag"}, "how far the robot goes of its wheels' way",
            {row("traction")});
    } else {
      value("floor", {"wheel_slip", "wheel_radius"}, slips, {travel});
    }
  }

  const GroundRobot& robot_;
  const std::vector<KinematicRow>& rows_;
  bool changes_;
};

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

namespace {

// What a well-kept file is off by, or what a robot changes by from log to log: whatever is a size
// stays, and what the floor or hands change is asked for.
std::vector<KinematicRow> rows_of(const GroundRobot& robot, bool changes) {
  const auto sd = [&](double of_file, double kept) { return changes ? kept : of_file; };
  std::vector<KinematicRow> rows;
  const double reach = reach_of(robot);
  if (is_holonomic(robot)) {
    rows = {{"ahead", 1, sd(kGainShare, kSlipShare), "ratio", "-"},
            {"aside", 1, sd(kGainShare, kKeptTurnShare), "ratio", "-"},
            {"turn", 1, sd(kGainShare, kKeptTurnShare), "ratio", "-"},
            {"traction", 1, sd(kGainShare, kKeptTractionShare), "ratio", "-"},
            {"load_x", robot.com_x_m.value_or(0), kLoadShare * reach, "x", "m", false, reach},
            {"load_y", robot.com_y_m.value_or(0), kLoadShare * reach, "y", "m", false, reach}};
  } else if (is_steered(robot)) {
    const double slow = robot.steering.understeer_s2_m2;
    rows = {{"steering_offset", 0, kSteering_rad, "angle", "rad"},
            {"steering_gain", 1, sd(kSteeringGainShare, kKeptTurnShare), "ratio", "-"},
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
      rows.push_back({"ahead", 1, sd(kRadiusShare, kSlipShare), "ratio", "-"});
      if (moves_later(robot))
        rows.push_back({"drive_lag", robot.motors.drive_lag_s, kLag_s, "tau", "s", true});
    }
  } else {
    const double radius = sd(skids(robot) ? kSkidRadiusShare : kRadiusShare, kSlipShare);
    const double apart = skids(robot) ? kSkidSeparationShare : kSeparationShare;
    rows = {{"left", 1, radius, "ratio", "-"},
            {"right", 1, radius, "ratio", "-"},
            {"separation", 1, sd(apart, kKeptTurnShare), "ratio", "-"}};
  }
  const bool slips = robot.drive == DriveKind::kAckermann && !changes;
  const double marker = (slips ? kCarMarkerShare : kMarkerShare) * reach;
  const double yaw = slips ? kCarMarkerYaw_rad : kMarkerYaw_rad;
  const Pose& X = robot.X_RM;
  rows.push_back({"lag", robot.motors.lag_s, kLag_s, "tau", "s", true});
  rows.push_back({"delay", robot.motors.delay_s, kDelay_s, "latency", "s"});
  rows.push_back({"marker_x", X.x, marker, "x", "m"});
  rows.push_back({"marker_y", X.y, marker, "y", "m"});
  rows.push_back({"marker_yaw", X.theta, yaw, "angle", "rad"});
  return rows;
}

}  // namespace

std::vector<KinematicRow> kinematic_rows(const GroundRobot& robot) {
  return rows_of(robot, /*changes=*/false);
}

std::vector<KinematicRow> change_rows(const GroundRobot& robot) {
  std::vector<KinematicRow> rows = rows_of(robot, /*changes=*/true);
  if (!is_steered(robot)) return rows;
  const double held_m_s2 = robot.friction * robot.friction_ratio * kGravity_m_s2;
  rows.push_back({"grip", std::log(held_m_s2), kGripShare, "log", "-"});
  rows.push_back({"slip_angle", kSlipAngle_rad, kKeptSlipAngle_rad, "angle", "rad"});
  rows.push_back({"grip_shape", std::log(2.0), kKeptGripShape, "shape", "-"});
  return rows;
}

std::vector<GroundHypothesis> change_hypotheses(const GroundRobot& robot,
                                                const std::vector<KinematicRow>& rows) {
  Catalogue catalogue(robot, rows, true);
  // What turns or travels on another floor has the floor's name.
  for (GroundHypothesis& h : catalogue.all) {
    for (GroundHypothesis& other : catalogue.all) {
      if (&h >= &other || h.freed.empty() || h.freed.size() != other.freed.size()) continue;
      if (h.freed[0].name == other.freed[0].name) other.freed.clear();
    }
  }
  std::erase_if(catalogue.all,
                [](const GroundHypothesis& h) { return h.freed.empty() && !h.put_right; });
  return std::move(catalogue.all);
}

std::vector<GroundHypothesis> ground_hypotheses(const GroundRobot& robot) {
  return Catalogue(robot, kinematic_rows(robot), false).all;
}

void add_gyro_scale(const RunLog& log, std::vector<KinematicRow>* rows) {
  const auto has_none = [](const LoggedRun& run) { return run.yaw_rates.empty(); };
  if (!std::ranges::all_of(log.runs, has_none))
    rows->push_back({kGyroScale, 1, kGyroShare, "ratio", "-"});
}

std::vector<GroundHypothesis> that_can_show(const RunLog& log, std::vector<GroundHypothesis> all) {
  std::erase_if(
      all, [&](const GroundHypothesis& h) { return log.relative ? h.of_world : h.of_increments; });
  for (GroundHypothesis& h : all) {
    // In a mirrored world every turn and every step aside is the other way, as if the robot's own
    // had been taken for one another, and so they are for a sensor that hangs upside down.  The
    // inverse of an increment is the way back: of reversed commands, or, as a sensor that looks
    // back sees it, of swapped sides.
    const bool sides = h.name == "sides_swapped" || h.name == "steering_reversed";
    if (log.relative && (sides || h.name == "command_reversed")) {
      h.aliases.emplace_back("increments_inverted");
      h.remedy +=
          " If each increment is the earlier pose in the later one's frame, invert them instead.";
    }
    if (!sides) continue;
    const std::string other =
        log.relative ? "a sensor that is mounted upside down" : "y and headings both mirrored";
    h.thing += " (or " + other + (log.relative ? ", or increments that are inverted)" : ")");
    h.remedy +=
        " If it is " + other +
        ", turn the signs of y and theta instead, and diagnose again: other values hold then.";
    h.aliases.emplace_back(log.relative ? "sensor_upside_down" : "axes_mirrored");
  }
  GroundHypothesis gyro{kGyroScale, {}, "the scale of the gyro", {}};
  add_gyro_scale(log, &gyro.freed);
  if (!gyro.freed.empty()) all.push_back(std::move(gyro));
  return all;
}

void tolerate_ramps(const GroundRobot& robot, const RunLog& log,
                    std::vector<GroundHypothesis>* all) {
  for (GroundHypothesis& h : *all) {
    if (h.name != "acceleration_limit") continue;
    KinematicRow& ramp = h.freed.front();
    const double shows = ramp_that_shows(robot, log, ramp.nominal, kLag_s);
    ramp.tolerance = std::min(shows, plausible_error(ramp));
    h.kept = ramp.tolerance;
  }
}

double value_in_file(const GroundRobot& robot, const std::string& name) {
  if (name == kGyroScale) return 1;
  for (const KinematicRow& row : change_rows(robot)) {
    if (row.name == name) return row.nominal;
  }
  for (const GroundHypothesis& h : ground_hypotheses(robot)) {
    for (const KinematicRow& row : h.freed) {
      if (row.name == name) return row.nominal;
    }
  }
  return 0;
}

}  // namespace gapfarm
