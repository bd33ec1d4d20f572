#include "common/parameters/ground.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "common/base/constants.h"
#include "common/base/ranges.h"
#include "common/parameters/rows.h"

namespace gapfarm {
namespace {

using enum ParameterKind;
using enum ParameterScale;
using std::numbers::pi;
using Put = std::function<void(GroundRobot&, double)>;

// A ramp that steep limits nothing.
constexpr double kNoRamp_m_s2 = 1000;

// A wheel's name as part of a key that TOML takes bare.
std::string key_word(std::string name) {
  for (char& c : name) {
    const bool bare = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '_' || c == '-';
    if (!bare) c = '_';
  }
  return name;
}

class Rows {
 public:
  explicit Rows(const GroundRobot& robot) : robot_(robot) {}

  void add(const std::string& key, const char* unit, double lower, double upper, double nominal,
           const std::string& summary, Put put, ParameterScale scale = kLinear,
           ParameterKind kind = kReal) {
    rows.push_back({key, unit, kind, scale, std::min(lower, nominal), std::max(upper, nominal),
                    nominal, summary});
    puts.push_back(std::move(put));
  }
  // A size: from half the robot's own to twice.
  void size(const std::string& key, const char* unit, double own, const std::string& summary,
            Put put) {
    if (own > 0) {
      add(key, unit, own / 2, own * 2, own, summary, std::move(put), kLog);
    } else {
      add(key, unit, own < 0 ? own * 2 : -1, own < 0 ? own / 2 : 1, own, summary, std::move(put));
    }
  }

  void wheels() {
    // Throttle is an acceleration of the robot: no radius comes into it.
    if (is_throttled(robot_)) return;
    std::set<std::string> done;
    for (const RobotWheel& w : robot_.wheels) {
      if (!w.driven || w.kind == WheelKind::kCaster || !done.insert(w.group).second) continue;
      const std::string group = w.group;
      size("wheels." + key_word(group) + ".radius", "m", *w.radius_m, "rolling radius",
           [group](GroundRobot& robot, double value) {
             for (RobotWheel& wheel : robot.wheels) {
               if (wheel.group == group) wheel.radius_m = value;
             }
           });
    }
  }

  void sizes() {
    if (robot_.drive == DriveKind::kOmni) {
      const double own = wheel_reach_m(robot_);
      size("robot_radius", "m", own, "centre to wheel", [own](GroundRobot& robot, double value) {
        for (RobotWheel& w : robot.wheels) {
          *w.x_m *= value / own;
          *w.y_m *= value / own;
        }
      });
      return;
    }
    if (!is_steered(robot_)) {
      const double own = extent(&RobotWheel::y_m);
      size("wheel_separation", "m", own, "left to right wheel, as they roll",
           stretch(own, &RobotWheel::y_m));
    }
    if (robot_.drive == DriveKind::kTracked) {
      const double own = robot_.wheels.front().contact_length_m.value_or(0);
      size("contact_length", "m", own, "front to rear contact of a tread",
           [](GroundRobot& robot, double value) {
             for (RobotWheel& w : robot.wheels) {
               if (w.kind == WheelKind::kTread) w.contact_length_m = value;
             }
           });
    } else if (robot_.drive != DriveKind::kDifferential) {
      const double own = extent(&RobotWheel::x_m);
      const Put move = stretch(own, &RobotWheel::x_m);
      const bool curve = is_steered(robot_);
      size("wheelbase", "m", own, "front to rear axle",
           [move, curve](GroundRobot& robot, double v) {
             move(robot, v);
             if (curve) robot.controller.wheelbase_m = v;
           });
    }
  }

  void floor() {
    add(
        "friction", "-", 0.02, 2, robot_.friction, "of the floor along the wheels",
        [](GroundRobot& robot, double v) { robot.friction = v; }, kLog);
    add(
        "friction_ratio", "-", 0.2, 5, robot_.friction_ratio,
        "friction across over along the wheels",
        [](GroundRobot& robot, double v) { robot.friction_ratio = v; }, kLog);
    if (has(WheelKind::kOmni) || has(WheelKind::kMecanum)) {
      add("roller_drag", "-", 0, 0.5, robot_.roller_drag, "of the rollers, over friction",
          [](GroundRobot& robot, double v) { robot.roller_drag = v; });
    }
    if (has(WheelKind::kMecanum)) {
      const double own = roller_angle();
      add("roller_angle", "rad", own / 2, std::min(2 * own, 1.4), own,
          "of mecanum rollers' axles from the way a wheel rolls", [](GroundRobot& robot, double v) {
            for (RobotWheel& w : robot.wheels) {
              if (w.kind != WheelKind::kMecanum) continue;
              w.roller_angle_rad = std::copysign(v, w.roller_angle_rad);
            }
          });
    }
    if (crossed()) {
      add("cross_load", "-", -0.9, 0.9, 0, "of front left and rear right over their even share",
          {});
    }
    if (has(WheelKind::kCaster)) {
      add("caster_drag", "-", 0, 1, robot_.caster_drag, "of casters, over friction of a wheel",
          [](GroundRobot& robot, double v) { robot.caster_drag = v; });
    }
    add(kGroundCreep, "-", 0, 0.5, 0, "slip over wheel speed at 0.7 of full traction", {});
    add("creep_speed", "m/s", 0, 0.5, 0,
        "slip at 0.7 of full traction at any speed, as of motors that give way", {});
  }

  void body() {
    const double far = wheel_reach_m(robot_);
    size("mass", "kg", *robot_.mass_kg, "of the whole robot",
         [](GroundRobot& robot, double v) { robot.mass_kg = v; });
    add("centre_of_mass.x", "m", *robot_.com_x_m - far / 2, *robot_.com_x_m + far / 2,
        *robot_.com_x_m, "ahead", [](GroundRobot& robot, double v) { robot.com_x_m = v; });
    add("centre_of_mass.y", "m", *robot_.com_y_m - far / 2, *robot_.com_y_m + far / 2,
        *robot_.com_y_m, "to the left", [](GroundRobot& robot, double v) { robot.com_y_m = v; });
    size("centre_of_mass.z", "m", *robot_.com_z_m, "over the floor",
         [](GroundRobot& robot, double v) { robot.com_z_m = v; });
    size("yaw_inertia", "kg m^2", *robot_.yaw_inertia_kg_m2, "about the centre of mass",
         [](GroundRobot& robot, double v) { robot.yaw_inertia_kg_m2 = v; });
  }

  void motors() {
    const RobotMotors& m = robot_.motors;
    add("delay", "s", m.delay_s - 1, m.delay_s + 1, m.delay_s,
        "from a command to its wheel, the offset of the clocks included",
        [](GroundRobot& robot, double v) { robot.motors.delay_s = v; });
    add("lag", "s", 0, std::max(1.0, 2 * m.lag_s), m.lag_s,
        is_steered(robot_) ? "first-order response of the steering"
                           : "first-order response of the wheels",
        [](GroundRobot& robot, double v) { robot.motors.lag_s = v; });
    if (is_throttled(robot_)) return;
    if (is_steered(robot_)) {
      add("drive_lag", "s", 0, std::max(1.0, 2 * m.drive_lag_s), m.drive_lag_s,
          "first-order response of the wheels",
          [](GroundRobot& robot, double v) { robot.motors.drive_lag_s = v; });
    }
    add(
        "acceleration_limit", "m/s^2", 0.01, kNoRamp_m_s2,
        m.acceleration_limit_m_s2.value_or(kNoRamp_m_s2), "of the wheels' surface",
        [](GroundRobot& robot, double v) {
          robot.motors.acceleration_limit_m_s2 = v < kNoRamp_m_s2 ? std::optional(v) : std::nullopt;
        },
        kLog);
    // Half of what would leave a drive at full command standing is more than any motor has.
    const double most = robot_.command == CommandKind::kDuties  ? 0.5
                        : robot_.command == CommandKind::kTwist ? 0.5
                                                                : 5;
    add("dead_band", "-", 0, most, m.dead_band,
        "of a command, in its own unit; of twists: m/s of a rim",
        [](GroundRobot& robot, double v) { robot.motors.dead_band = v; });
    if (robot_.command == CommandKind::kDuties) {
      size("full_speed", "rad/s", m.full_speed_rad_s.value_or(10), "of a wheel at duty 1",
           [](GroundRobot& robot, double v) { robot.motors.full_speed_rad_s = v; });
    }
  }

  void steering() {
    if (!is_steered(robot_)) return;
    const RobotSteering& s = robot_.steering;
    add("steering.offset", "rad", s.offset_rad - 0.2, s.offset_rad + 0.2, s.offset_rad,
        "wheels point here when commanded straight",
        [](GroundRobot& robot, double v) { robot.steering.offset_rad = v; });
    const Put put_gain = [](GroundRobot& robot, double v) { robot.steering.gain = v; };
    if (s.gain > 0) {  // encoders are scaled by hand: more than a size may be off by
      add("steering.gain", "-", s.gain / 10, s.gain * 10, s.gain, "turned over commanded", put_gain,
          kLog);
    } else {
      size("steering.gain", "-", s.gain, "turned over commanded", put_gain);
    }
    // A model car on a slippery floor has come to 0.43.
    add("understeer", "s^2/m^2", 0, std::max(1.0, 4 * s.understeer_s2_m2), s.understeer_s2_m2,
        "curvature / (1 + understeer v^2)",
        [](GroundRobot& robot, double v) { robot.steering.understeer_s2_m2 = v; });
  }

  void throttle() {
    if (!is_throttled(robot_)) return;
    const RobotThrottle& t = robot_.throttle;
    const auto row = [&](const char* key, const char* unit, double RobotThrottle::*at, double least,
                         const char* summary) {
      add(std::string("throttle.") + key, unit, 0, std::max(least, 3 * t.*at), t.*at, summary,
          [at](GroundRobot& robot, double v) { robot.throttle.*at = v; });
    };
    row("gain", "m/s^2", &RobotThrottle::gain, 5, "acceleration a unit of throttle at rest");
    row("zero", "-", &RobotThrottle::zero, 0.4, "throttle that moves nothing");
    row("back_emf", "1/s", &RobotThrottle::back_emf, 3, "of that acceleration lost a m/s");
    row("drag", "1/s", &RobotThrottle::drag, 1, "deceleration a m/s");
    row("coulomb", "m/s^2", &RobotThrottle::coulomb, 1, "deceleration at any speed");
    row("cornering", "-", &RobotThrottle::cornering, 1, "deceleration a m/s and rad/s");
  }

  void marker() {
    const double far = wheel_reach_m(robot_);
    const Pose& X = robot_.X_RM;
    add("marker.x", "m", X.x - far, X.x + far, X.x, "the tracked point, ahead",
        [](GroundRobot& robot, double v) { robot.X_RM.x = v; });
    add("marker.y", "m", X.y - far, X.y + far, X.y, "the tracked point, to the left",
        [](GroundRobot& robot, double v) { robot.X_RM.y = v; });
    add("marker.yaw", "rad", X.theta - 0.5, X.theta + 0.5, X.theta, "heading of the tracked point",
        [](GroundRobot& robot, double v) { robot.X_RM.theta = v; });
  }

  void noise() {
    for (Parameter& row : window_noise_rows(wheel_reach_m(robot_))) {
      rows.push_back(std::move(row));
      puts.emplace_back();
    }
  }

  void world() {
    add(kGroundGravity, "m/s^2", 1, 30, kGravity_m_s2, "downward", {});
    add(kGroundStepRate, "Hz", 30, 2000, 240, "physics steps a second", {}, kLog, kInteger);
    add(kGroundSolverIterations, "-", 1, 100, 10, "of the contact solver", {}, kLinear, kInteger);
  }

  std::vector<Parameter> rows;
  std::vector<Put> puts;

 private:
  // Moves wheels along an axis in proportion.
  static Put stretch(double own, std::optional<double> RobotWheel::*at, bool all = false) {
    return [own, at, all](GroundRobot& robot, double value) {
      for (RobotWheel& w : robot.wheels) {
        if (w.kind != WheelKind::kCaster || all) *(w.*at) *= value / own;
      }
    };
  }
  bool has(WheelKind kind) const { return contains(robot_.wheels, kind, &RobotWheel::kind); }
  double extent(std::optional<double> RobotWheel::*at) const {
    double least = 0, most = 0;
    for (const RobotWheel& w : robot_.wheels) {
      if (w.kind == WheelKind::kCaster) continue;
      least = std::min(least, *(w.*at));
      most = std::max(most, *(w.*at));
    }
    return most - least;
  }
  // Of the first mecanum wheel, without its sign.
  double roller_angle() const {
    const auto first = std::find_if(robot_.wheels.begin(), robot_.wheels.end(),
                                    [](const auto& w) { return w.kind == WheelKind::kMecanum; });
    return std::abs(first->roller_angle_rad);
  }
  // Four wheels of a stiff frame: a diagonal may carry more than the other.
  bool crossed() const {
    const bool skids = robot_.drive == DriveKind::kSkid || robot_.drive == DriveKind::kMecanum;
    return skids && robot_.wheels.size() == 4;
  }

  const GroundRobot& robot_;
};

}  // namespace

GroundTable::GroundTable(const GroundRobot& robot) : robot_(robot) {
  Rows rows(robot_);
  rows.wheels();
  rows.sizes();
  rows.floor();
  rows.body();
  rows.motors();
  rows.steering();
  rows.throttle();
  rows.marker();
  rows.noise();
  rows.world();
  table_ = std::make_unique<ParameterTable>(std::move(rows.rows), std::span<const Effect>());
  put_ = std::move(rows.puts);
}

GroundRobot GroundTable::robot_at(const ParameterValues& values) const {
  GroundRobot robot = robot_;
  for (std::size_t row = 0; row < put_.size(); ++row) {
    if (put_[row] && values[row] != table()[row].nominal) put_[row](robot, values[row]);
  }
  return robot;
}

std::vector<Parameter> window_noise_rows(double far_m) {
  using rows::real;
  return {real(kGroundTravelNoise, "m/sqrt(m)", 1e-5, far_m, 0.05 * far_m,
               "standard deviation of the way after a metre of it; grows with its root", kLog),
          real(kGroundTurnNoise, "rad/sqrt(m)", 1e-5, 1, 0.05,
               "standard deviation of the heading after a metre of the wheels' way", kLog),
          real(kGroundPositionNoise, "m", 1e-5, far_m, 0.02 * far_m,
               "standard deviation of a measured x and y", kLog),
          real(kGroundHeadingNoise, "rad", 1e-5, 0.5, 0.01,
               "standard deviation of a measured heading", kLog)};
}

const ParameterTable& ground_table() {
  static const GroundTable* const table = [] {
    GroundRobot robot;
    robot.controller.wheel_separation_m = 0.3;
    robot.controller.wheel_radius_m = 0.05;
    (void)complete_robot(&robot);
    return new GroundTable(robot);
  }();
  return table->table();
}

}  // namespace gapfarm
