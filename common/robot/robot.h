// What a ground robot is: plain data, whatever file it came from (docs/formats.md).
//
// Frame R of the robot: x ahead, y left, z up, origin on the floor midway between the driven wheels
// (of a four-wheel drive: between all of them; of a car: the rear axle).  A value that no file
// stated is empty; complete_robot() says what is then taken.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/pose/pose.h"

namespace gapfarm {

enum class DriveKind { kDifferential, kSkid, kTracked, kOmni, kMecanum, kAckermann, kTricycle };
inline std::span<const std::string> drive_names() {
  static const std::vector<std::string> names = {"differential", "skid",      "tracked", "omni",
                                                 "mecanum",      "ackermann", "tricycle"};
  return names;
}

// A swivelling caster and a ball are one kind: they carry load and hardly resist.
enum class WheelKind { kPlain, kOmni, kMecanum, kCaster, kTread };
inline std::span<const std::string> wheel_names() {
  static const std::vector<std::string> names = {"plain", "omni", "mecanum", "caster", "tread"};
  return names;
}

enum class WheelSide { kNone, kLeft, kRight };  // whose motor drives it
inline std::span<const std::string> side_names() {
  static const std::vector<std::string> names = {"none", "left", "right"};
  return names;
}

struct RobotWheel {
  std::string name;
  WheelKind kind = WheelKind::kPlain;
  WheelSide side = WheelSide::kNone;
  std::optional<double> x_m, y_m;  // where it touches the floor, R; of a tread: its middle
  std::optional<double> radius_m;
  std::optional<double> width_m;
  std::optional<double> contact_length_m;  // of a tread
  double heading_rad = 0;  // rolls this way when it turns forward, steering straight
  bool driven = true;
  bool steered = false;
  // kMecanum: the axle of the roller on the floor, from the rolling direction; what pushes the
  // robot points along it.  Front left and rear right -pi/4, the others pi/4, on the usual robot.
  double roller_angle_rad = 0;
  // Wheels of one group share their sizes' rows of the parameter table; empty: its own name.
  std::string group;
};

// What the numbers of a command row mean, channel by channel (channels below).
enum class CommandKind {
  kDuties,            // [-1, 1] of each side's or wheel's motor
  kWheelSpeeds,       // rad/s of each side or wheel
  kTwist,             // v m/s, omega rad/s, and vy m/s where the drive can; through the controller
  kThrottleSteering,  // throttle and steering, [-1, 1]
  kSpeedSteering,     // rad/s of the traction wheel (or both), and rad of the steering
};
inline std::span<const std::string> command_kind_names() {
  static const std::vector<std::string> names = {"duties", "wheel_speeds", "twist",
                                                 "throttle_steering", "speed_steering"};
  return names;
}

// The controller's own idea of the robot, in the words of ros2_controllers.  It turns twists into
// wheel speeds, right or wrong; the simulation rolls on the wheels above.
struct ControllerKinematics {
  std::optional<double> wheel_separation_m;
  std::optional<double> wheel_radius_m;
  double wheel_separation_multiplier = 1;
  double left_wheel_radius_multiplier = 1;
  double right_wheel_radius_multiplier = 1;
  std::optional<double> wheelbase_m;
  std::optional<double> traction_track_width_m;
  std::optional<double> steering_track_width_m;
  std::optional<double> sum_of_robot_center_projection_m;  // mecanum: lx + ly
  std::optional<double> robot_radius_m;                    // omni: centre to wheel
  double wheel_offset_rad = 0;                             // omni: of the first wheel
};

// From command to wheel speed.
struct RobotMotors {
  bool closed_loop = true;  // false: an open duty, whose speed the battery sets
  double delay_s = 0;       // dead time; below 0 where poses are late
  double lag_s = 0;         // first order, of the wheels; of a car: of its steering
  double drive_lag_s = 0;   // of a car: first order, of the wheels
  std::optional<double> acceleration_limit_m_s2;  // of the wheels' surface
  double dead_band = 0;                     // in the command's own unit; of twists: m/s of each rim
  std::optional<double> command_timeout_s;  // without a new row the wheels stop
  std::optional<double> full_speed_rad_s;   // of a wheel at duty 1
  std::optional<double> full_surface_speed_m_s;  // of its rim: complete_robot() makes it the above
};

// acceleration = max(throttle - zero, 0) (gain - back_emf v) - drag v - coulomb sign(v)
//                - cornering |yaw rate| v, m/s^2.
struct RobotThrottle {
  double gain = 1;
  double zero = 0;
  double back_emf = 0;
  double drag = 0;
  double coulomb = 0;
  double cornering = 0;
};

// Angle of the equivalent middle wheel.
struct RobotSteering {
  struct Point {
    double command = 0;
    double angle_rad = 0;
  };
  std::vector<Point> table;  // commands ascending, linear between; empty: command times gain
  double gain = 1;           // rad per unit of command, or times the table's angle
  double offset_rad = 0;
  std::optional<double> limit_rad;
  std::optional<double> rate_limit_rad_s;
  double understeer_s2_m2 = 0;  // curvature / (1 + understeer v^2)
};

struct GroundRobot {
  std::string name;
  DriveKind drive = DriveKind::kDifferential;
  std::vector<RobotWheel> wheels;
  std::optional<double> mass_kg;
  std::optional<double> com_x_m, com_y_m, com_z_m;  // centre of mass, z over the floor
  std::optional<double> yaw_inertia_kg_m2;          // about the centre of mass
  std::optional<double> body_length_m, body_width_m, body_height_m;  // a box of even mass
  double friction = 0.7;          // of the floor along the wheels
  double friction_ratio = 1;      // across over along
  double rolling_resistance = 0;  // share of weight
  double roller_drag = 0.02;      // omni, mecanum: friction across over along
  double caster_drag = 0;         // friction of a caster over that of a wheel
  ControllerKinematics controller;
  // How far apart wheels that never slip would stand to turn as this robot does (its effective
  // track width); none: as far as its controller believes.
  std::optional<double> effective_separation_m;
  RobotMotors motors;
  RobotThrottle throttle;
  RobotSteering steering;
  Pose X_RM;  // the tracked marker on the robot
  CommandKind command = CommandKind::kWheelSpeeds;
  // Columns of the command log in order.  kDuties, kWheelSpeeds: "left" and "right" or names of
  // wheels; kTwist: "v", "omega" and "vy"; kThrottleSteering: "throttle", "steering";
  // kSpeedSteering: "speed", "steering".
  std::vector<std::string> channels = {"left", "right"};
  // The channels are what encoders read, not what the controller commanded: motors follow already.
  bool measured = false;
  // What reading took from where and every disagreement; a sentence each, for the user.
  std::vector<std::string> notes;

  // Null when there is none.
  const RobotWheel* wheel(std::string_view wanted) const;
};

inline bool is_steered(const GroundRobot& robot) {
  return robot.drive == DriveKind::kAckermann || robot.drive == DriveKind::kTricycle;
}
inline bool is_holonomic(const GroundRobot& robot) {
  return robot.drive == DriveKind::kOmni || robot.drive == DriveKind::kMecanum;
}
inline bool skids(const GroundRobot& robot) {
  return robot.drive == DriveKind::kSkid || robot.drive == DriveKind::kTracked;
}
inline bool is_throttled(const GroundRobot& robot) {
  return robot.command == CommandKind::kThrottleSteering;
}

// The first driven wheel whose radius is known, of all or of a side; null: there is none.
const RobotWheel* driven_wheel(const GroundRobot& robot, std::optional<WheelSide> side = {});
// That wheel's radius, of "left" or "right"; 0: there is none.
double side_radius_m(const GroundRobot& robot, std::string_view side);
// How far apart the robot's wheels turn, once what slips is taken as standing wider: as stated, or
// by its controller's separation and multiplier; none: neither is known.
std::optional<double> turning_separation_m(const GroundRobot& robot);
// That over the wheel_separation: the multiplier of a controller that turns the robot as asked.
double turning_multiplier(const GroundRobot& robot);
// How far the farthest wheel stands from the origin; 0 where no place is known.
double wheel_reach_m(const GroundRobot& robot);
// The one of these names of channels that is the wheel's: its own name, or its side.
std::optional<std::size_t> channel_of(const RobotWheel& wheel,
                                      const std::vector<std::string>& channels);

// What nobody states of a twist's controller becomes what the wheels, whose sizes are known, have
// now: a fit may change these later, and the controller does not know.
void complete_controller(GroundRobot& robot);

// Of a box of even mass about the vertical, kg m^2.
inline double box_yaw_inertia(double mass_kg, double length_m, double width_m) {
  return mass_kg * (length_m * length_m + width_m * width_m) / 12;
}

// Fills what follows from the drive and the sizes that are there: wheels at +-wheel_separation / 2
// where only radii are stated; front and rear ones of a skid-steer so far apart that four-point
// Coulomb theory gives its wheel_separation_multiplier; radii, masses and heights in proportion.
// Each thing that was assumed becomes a note.  Errors: a drive that cannot be without a size that
// is missing (the message names it), channels that the drive does not have, numbers out of range.
Status complete_robot(GroundRobot* robot);

// What complete_robot() asks of its result, for robots that come from elsewhere.
Status check_robot(const GroundRobot& robot);

// Sizes of a tracked robot that are no parameters.
struct RobotSize {
  // The outline; the mass is spread over this box for the moments of inertia.
  double body_length_m = 0, body_width_m = 0, body_height_m = 0;
  // Spheres on which the tread model stands.
  double contact_radius_m = 0;
  // Wheels of the wheel model; surface speed = radius * wheel speed.
  double wheel_radius_m = 0, wheel_half_width_m = 0;
  // Of a contact, in Bullet's units of 1 / mass: a heavy robot must not sink in.
  double contact_softness = 0;

  bool operator==(const RobotSize&) const = default;
};

// A completed robot (complete_robot()).  The error lists everything that is wrong, a line each:
// "file:line:column: sentence", with "did you mean" for unknown words.
Result<GroundRobot> parse_robot(std::string_view text, const std::string& path);
Result<GroundRobot> read_robot(const std::string& path);

// The text of robot.toml; reads back as the same robot, every double as the same bits.
std::string format_robot(const GroundRobot& robot);

}  // namespace gapfarm
