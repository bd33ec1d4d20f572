#include <algorithm>
#include <cmath>

#include "common/base/text.h"
#include "common/trials/text/csv.h"
#include "master/io/robot_files/understand.h"

namespace gapfarm {
namespace {

// Sizes further apart than this are two sizes: a per cent, and no less than half a millimetre.
constexpr double kShare = 0.01;
constexpr double kLeast_m = 5e-4;

bool differ(double a, double b) {
  return std::abs(a - b) > std::max(kLeast_m, kShare * std::max(std::abs(a), std::abs(b)));
}

std::string metres(double value) { return format_double(std::round(value * 1e5) / 1e5) + " m"; }

template <class Number>
void take(const std::vector<DriveFacts>& facts, const char* name, Number& to) {
  for (const DriveFacts& fact : facts) {
    if (const StatedNumber* stated = fact.number(name)) {
      to = stated->value;
      return;
    }
  }
}

// What the URDF's own geometry says about a size; none where it says nothing.
struct Measured {
  std::optional<double> separation, wheelbase, traction_track, steering_track, radius;
  std::string radius_of;  // the wheel
};

Measured measure(const RobotReading& reading) {
  Measured m;
  double left = 0, right = 0;
  double front_x = -1e9, rear_x = 1e9;
  std::vector<double> steered_y, straight_y;
  for (std::size_t i = 0; i < reading.robot.wheels.size(); ++i) {
    const RobotWheel& wheel = reading.robot.wheels[i];
    if (wheel.kind == WheelKind::kCaster || !wheel.x_m || !wheel.y_m) continue;
    front_x = std::max(front_x, *wheel.x_m);
    rear_x = std::min(rear_x, *wheel.x_m);
    (wheel.steered ? steered_y : straight_y).push_back(*wheel.y_m);
    if (wheel.driven) {
      left = std::max(left, *wheel.y_m);
      right = std::min(right, *wheel.y_m);
      if (!m.radius && wheel.radius_m && !reading.sources[i].joint.empty()) {
        m.radius = wheel.radius_m;
        m.radius_of = "joint '" + reading.sources[i].joint + "', " + reading.sources[i].radius_from;
      }
    }
  }
  const auto spread = [](const std::vector<double>& y) -> std::optional<double> {
    if (y.size() < 2) return {};
    const auto [low, high] = std::minmax_element(y.begin(), y.end());
    return *high - *low;
  };
  if (left > right) m.separation = left - right;
  if (front_x - rear_x > 1e-3) m.wheelbase = front_x - rear_x;
  m.steering_track = spread(steered_y);
  m.traction_track = spread(straight_y);
  return m;
}

class Comparison {
 public:
  Comparison(const std::vector<DriveFacts>& facts, RobotReading& reading)
      : facts_(facts), reading_(reading), measured_(measure(reading)) {}

  void run() {
    for (const DriveFacts& fact : facts_) {
      held_against(fact, "wheel_separation", measured_.separation, "its driven wheels' places");
      held_against(fact, "wheel_radius", measured_.radius, measured_.radius_of);
      held_against(fact, "wheelbase", measured_.wheelbase, "its axles' places");
      held_against(fact, "traction_track_width", measured_.traction_track, "its wheels' places");
      held_against(fact, "steering_track_width", measured_.steering_track,
                   "its steered wheels' places");
      if (measured_.separation && measured_.wheelbase) {
        held_against(fact, "lx_plus_ly", 0.5 * (*measured_.separation + *measured_.wheelbase),
                     "its wheels' places");
      }
      // A controller file alone has no wheels that it could name.
      if (!reading_.sources.empty()) check_names(fact);
    }
    compare_stated();
    compare_wheels();
  }

 private:
  void report(std::string sentence) { reading_.disagreements.push_back(std::move(sentence)); }

  void held_against(const DriveFacts& fact, const char* name, const std::optional<double>& urdf,
                    const std::string& from) {
    const StatedNumber* stated = fact.number(name);
    if (stated == nullptr || !urdf || !differ(stated->value, *urdf)) return;
    const bool diameter = stated->key.find("iameter") != stated->key.npos;
    report(fact.place(stated->line) + ": " + stated->key + " " +
           metres(diameter ? 2 * stated->value : stated->value) +
           (diameter ? " (radius " + metres(stated->value) + ")" : "") + ", but the URDF says " +
           metres(*urdf) + " (" + from + ")");
  }

  const RobotWheel* wheel_of(const std::string& joint) const {
    for (std::size_t i = 0; i < reading_.sources.size(); ++i) {
      if (reading_.sources[i].joint == joint) return &reading_.robot.wheels[i];
    }
    return nullptr;
  }

  void check_names(const DriveFacts& fact) {
    for (const auto& [role, stated] : fact.joints) {
      for (const std::string& joint : stated.names) {
        const RobotWheel* wheel = wheel_of(joint);
        if (wheel == nullptr) {
          if (role != "steering" && !turns(joint)) {
            report(fact.place(stated.line) + ": " + stated.key + " names '" + joint +
                   "', which is no wheel of the URDF");
          }
          continue;
        }
        const bool left = role.find("left") != role.npos;
        const bool right = role.find("right") != role.npos;
        if ((left && *wheel->y_m < 0) || (right && *wheel->y_m > 0)) {
          report(fact.place(stated.line) + ": " + stated.key + " names '" + joint +
                 "', which the URDF puts on the " + (left ? "right" : "left") +
                 ": the sides are swapped in one of them");
        }
      }
    }
  }

  bool turns(const std::string& joint) const {
    return std::ranges::any_of(reading_.sources,
                               [&](const WheelSource& source) { return source.turning == joint; });
  }

  // Two controllers or plugins on one thing.
  void compare_stated() {
    for (std::size_t i = 0; i < facts_.size(); ++i) {
      for (const auto& [name, a] : facts_[i].numbers) {
        for (std::size_t k = i + 1; k < facts_.size(); ++k) {
          const StatedNumber* b = facts_[k].number(name);
          if (b == nullptr || !differ(a.value, b->value)) continue;
          report(facts_[i].place(a.line) + ": " + name + " " + format_double(a.value) + ", but " +
                 facts_[k].place(b->line) + " says " + format_double(b->value));
        }
      }
      if (facts_[i].drive.empty() || i == 0 || facts_[0].drive.empty()) continue;
      if (facts_[i].drive != facts_[0].drive) {
        report(facts_[0].place(facts_[0].line) + ": a " + facts_[0].drive + " drive, but " +
               facts_[i].place(facts_[i].line) + " says " + facts_[i].drive);
      }
    }
  }

  // Heights of axles are no radii that anybody stated.
  bool guessed(const RobotWheel& wheel) const {
    const auto i = static_cast<std::size_t>(&wheel - reading_.robot.wheels.data());
    return reading_.sources[i].radius_from.find("height") != std::string::npos;
  }

  // Wheels of one robot that are not alike.
  void compare_wheels() {
    const RobotWheel* first = nullptr;
    for (const RobotWheel& wheel : reading_.robot.wheels) {
      if (!wheel.driven || !wheel.radius_m || guessed(wheel)) continue;
      if (first == nullptr) first = &wheel;
      if (differ(*first->radius_m, *wheel.radius_m)) {
        report("wheel " + first->name + " has radius " + metres(*first->radius_m) + ", wheel " +
               wheel.name + " " + metres(*wheel.radius_m));
      }
    }
    std::vector<std::string> backward;
    bool some_ahead = false;
    for (std::size_t i = 0; i < reading_.sources.size(); ++i) {
      if (!reading_.robot.wheels[i].driven) continue;
      const WheelSource& source = reading_.sources[i];
      if (source.turns_backward) backward.push_back("'" + source.joint + "'");
      some_ahead |= !source.turns_backward;
    }
    if (backward.empty()) return;
    reading_.remarks.push_back("a positive turn of " + joined(backward) +
                               " rolls the robot back: mind the sign of recorded joint states" +
                               (some_ahead ? " (the other wheels roll it ahead)" : ""));
  }

  const std::vector<DriveFacts>& facts_;
  RobotReading& reading_;
  Measured measured_;
};

void take_commands(const std::vector<DriveFacts>& facts, GroundRobot& robot) {
  if (!facts.empty()) {
    robot.command = CommandKind::kTwist;
    robot.channels = {"v", "omega"};
    if (is_holonomic(robot)) robot.channels.emplace_back("vy");
    return;
  }
  robot.command = CommandKind::kWheelSpeeds;
  robot.channels = {"left", "right"};
  if (is_holonomic(robot)) {
    robot.channels.clear();
    for (const RobotWheel& wheel : robot.wheels) {
      if (wheel.driven) robot.channels.push_back(wheel.name);
    }
  }
  if (is_steered(robot)) {
    robot.command = CommandKind::kSpeedSteering;
    robot.channels = {"speed", "steering"};
  }
}

}  // namespace

void take_controller(const std::vector<DriveFacts>& facts, RobotReading& reading) {
  GroundRobot& robot = reading.robot;
  ControllerKinematics& c = robot.controller;
  for (const auto& [name, size] : kControllerSizes) take(facts, name, c.*size);
  for (const auto& [name, factor] : kControllerFactors) take(facts, name, c.*factor);
  take(facts, "wheel_offset", c.wheel_offset_rad);
  take(facts, "max_steering", robot.steering.limit_rad);
  // A limit of 0 means none in Gazebo's plugins.
  std::optional<double> acceleration, timeout;
  take(facts, "max_acceleration", acceleration);
  take(facts, "max_wheel_acceleration", acceleration);
  if (acceleration && *acceleration > 0) robot.motors.acceleration_limit_m_s2 = acceleration;
  take(facts, "cmd_vel_timeout", timeout);
  if (timeout && *timeout > 0) robot.motors.command_timeout_s = timeout;
  const Measured measured = measure(reading);
  // ros_control takes sizes that its file does not state from the URDF.
  if (!c.wheel_separation_m) c.wheel_separation_m = measured.separation;
  if (!c.wheel_radius_m) c.wheel_radius_m = measured.radius;
  if (!c.wheelbase_m) c.wheelbase_m = measured.wheelbase;
  if (!c.steering_track_width_m) c.steering_track_width_m = measured.steering_track;
  if (!c.traction_track_width_m && measured.steering_track) {
    c.traction_track_width_m = measured.traction_track;
  }
  take_commands(facts, robot);
}

void compare_facts(const std::vector<DriveFacts>& facts, RobotReading& reading) {
  Comparison(facts, reading).run();
}

std::vector<std::string> compare_readings(const RobotReading& a, const std::string& file_a,
                                          const RobotReading& b, const std::string& file_b) {
  std::vector<std::string> all;
  const auto report = [&](const std::string& what, double x, double y, const char* unit) {
    all.push_back(what + " is " + format_double(std::round(x * 1e5) / 1e5) + unit + " in " +
                  file_a + ", but " + format_double(std::round(y * 1e5) / 1e5) + unit + " in " +
                  file_b);
  };
  const double mass_a = a.robot.mass_kg.value_or(0), mass_b = b.robot.mass_kg.value_or(0);
  if (std::abs(mass_a - mass_b) > kShare * std::max(mass_a, mass_b)) {
    report("the mass", mass_a, mass_b, " kg");
  }
  const Measured m = measure(a), n = measure(b);
  for (const auto& [what, size] : {std::pair{"the wheels' radius", &Measured::radius},
                                   {"the wheels' separation", &Measured::separation},
                                   {"the wheelbase", &Measured::wheelbase}}) {
    const auto &x = m.*size, &y = n.*size;
    if (x && y && differ(*x, *y)) report(what, *x, *y, " m");
  }
  if (a.robot.drive != b.robot.drive) {
    all.push_back("the drive is " + drive_names()[static_cast<std::size_t>(a.robot.drive)] +
                  " in " + file_a + ", but " +
                  drive_names()[static_cast<std::size_t>(b.robot.drive)] + " in " + file_b);
  }
  return all;
}

Result<RobotReading> understand_controllers(const std::vector<DriveFacts>& controllers) {
  const std::span<const std::string> drives = drive_names();
  for (const DriveFacts& fact : controllers) {
    const auto drive = std::ranges::find(drives, fact.drive);
    if (drive == drives.end()) continue;
    RobotReading reading;
    reading.robot.name = fact.name;
    reading.robot.drive = static_cast<DriveKind>(drive - drives.begin());
    const bool two_each = fact.joints_of({"left"}).size() >= 2;
    if (reading.robot.drive == DriveKind::kDifferential && two_each) {
      reading.robot.drive = DriveKind::kSkid;
    }
    reading.evidence.push_back(fact.place(fact.line) + ": " +
                               (fact.type.empty() ? fact.name : fact.type) + " says " + fact.drive +
                               (two_each ? ", with several wheels a side" : ""));
    take_controller(controllers, reading);
    compare_facts(controllers, reading);
    return reading;
  }
  return Error{(controllers.empty() ? std::string("controllers") : controllers[0].file) +
               ":1: found no controller whose drive is known, expected one of diff_drive, "
               "mecanum_drive, omni_wheel_drive, ackermann or tricycle; give the robot's URDF too"};
}

}  // namespace gapfarm
