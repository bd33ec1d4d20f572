// Logs that are the wrong way round, or in another unit.
#include <cmath>
#include <numbers>
#include <string_view>

#include "common/base/ranges.h"
#include "master/ground/catalogue.h"
#include "master/ground/put_right.h"

namespace gapfarm {
namespace {

using std::numbers::pi;

using ChannelPairs = std::vector<std::pair<std::size_t, std::size_t>>;

// Left and right, by their names.
ChannelPairs channel_pairs(const GroundRobot& robot) {
  ChannelPairs pairs;
  for (std::size_t i = 0; i < robot.channels.size(); ++i) {
    std::string other = robot.channels[i];
    const auto at = other.find("left");
    if (at == std::string::npos) continue;
    other.replace(at, 4, "right");
    for (std::size_t j = 0; j < robot.channels.size(); ++j) {
      if (robot.channels[j] == other) pairs.emplace_back(i, j);
    }
  }
  return pairs;
}

auto swap_commands(ChannelPairs pairs) {
  return change_commands([pairs = std::move(pairs)](std::vector<double>& v) {
    for (const auto& [a, b] : pairs) std::swap(v[a], v[b]);
  });
}

// Of the channels where `of` is set; none of a log in which they are all within `beyond`.
std::function<void(RunLog*)> scale_commands(const std::vector<bool>& of, double factor,
                                            double beyond) {
  return [of, factor, beyond](RunLog* log) {
    double most = 0;
    const auto each = [&](const std::function<void(double&)>& visit) {
      change_commands([&](std::vector<double>& v) {
        for (std::size_t c = 0; c < v.size(); ++c) {
          if (of[c]) visit(v[c]);
        }
      })(log);
    };
    each([&](double& value) { most = std::max(most, std::abs(value)); });
    if (most > beyond) each([&](double& value) { value *= factor; });
  };
}

// `channel`: of those whose names begin so; `alias`: what else makes all motions larger than
// commanded; `beyond`: what no command in the right unit exceeds, and some do in this.
struct CommandUnit {
  CommandKind of;
  const char *channel, *thing, *name;
  double factor;
  const char* alias;
  double beyond = 0;
};

constexpr CommandKind kWheels = CommandKind::kWheelSpeeds, kTwists = CommandKind::kTwist,
                      kSteered = CommandKind::kSpeedSteering,
                      kThrottled = CommandKind::kThrottleSteering;
constexpr double kByRadius = 0;  // a factor: 1 over the driven wheel's radius
constexpr CommandUnit kCommandUnits[] = {
    {kWheels, "", "wheel speeds", "rpm", 2 * pi / 60, "wheel_radius"},
    {kWheels, "", "wheel speeds", "degrees a second", pi / 180, "wheel_radius"},
    {kWheels, "", "wheel speeds", "turns a second", 2 * pi, "wheel_radius"},
    {kWheels, "", "wheel speeds", "m/s", kByRadius, "wheel_radius"},
    {kSteered, "speed", "wheel's speed", "rpm", 2 * pi / 60, "wheel_radius"},
    {kSteered, "speed", "wheel's speed", "degrees a second", pi / 180, "wheel_radius"},
    {kSteered, "speed", "wheel's speed", "m/s", kByRadius, "wheel_radius"},
    {kSteered, "steering", "steering", "degrees", pi / 180, "steering_gain", pi / 2},
    {kThrottled, "throttle", "throttle", "per cent", 0.01, "throttle_gain", 1},
    {kThrottled, "steering", "steering", "per cent", 0.01, "steering_gain", 1},
    {CommandKind::kDuties, "", "duties", "per cent", 0.01, "speed_gain", 1},
    {kTwists, "v", "commanded speeds", "km/h", 1 / 3.6, "pose_scale"},
    {kTwists, "v", "commanded speeds", "cm/s", 1e-2, "pose_scale"},
    {kTwists, "v", "commanded speeds", "mm/s", 1e-3, "pose_scale"},
    {kTwists, "omega", "commanded turns", "degrees a second", pi / 180, "turn_gain"},
    {kTwists, "omega", "commanded turns", "rpm", 2 * pi / 60, "turn_gain"}};

}  // namespace

void Catalogue::wrong_commands() {
  const auto pairs = channel_pairs(robot_);
  if (!pairs.empty()) {
    fault("sides_swapped", {}, "left and right of the commands",
          "Swap the columns of the two sides.", swap_commands(pairs));
    for (const bool left : {true, false}) {
      fault("side_reversed", {"command_sign"},
            std::string("the sign of the ") + (left ? "left" : "right") + " side",
            "Turn the sign of that column.", change_commands([pairs, left](std::vector<double>& v) {
              for (const auto& [l, r] : pairs) v[left ? l : r] *= -1;
            }));
    }
  }
  // A robot of wheels that push it several ways has a column for each.
  const bool one_a_wheel = is_holonomic(robot_) && robot_.command != kTwists;
  for (std::size_t c = 0; c < robot_.channels.size(); ++c) {
    const std::string& channel = robot_.channels[c];
    if (one_a_wheel) {
      fault("side_reversed", {"command_sign"}, "the sign of " + channel,
            "Turn the sign of that column.",
            change_commands([c](std::vector<double>& v) { v[c] *= -1; }));
    }
    for (std::size_t d = c + 1; d < robot_.channels.size(); ++d) {
      if (!one_a_wheel && !pairs.empty()) continue;
      fault("channels_swapped", {"sides_swapped"},
            channel + " and " + robot_.channels[d] + " of the commands", "Swap these two columns.",
            swap_commands({{c, d}}));
    }
  }
  fault("command_reversed", {"command_sign"}, "the sign of every command",
        "Turn the sign of the commands.", change_commands([](std::vector<double>& v) {
          for (double& value : v) value = -value;
        }));
  constexpr std::string_view kOfNoWheel[] = {"steering", "omega", "vy", "v", "speed", "throttle"};
  for (std::size_t c = 0; c < robot_.channels.size(); ++c) {
    const std::string& channel = robot_.channels[c];
    if (!contains(kOfNoWheel, channel)) continue;
    const bool turns = channel == "steering" || channel == "omega";
    fault(turns ? "steering_reversed" : "command_reversed", {"command_sign"},
          "the sign of " + channel, "Turn the sign of that column.",
          change_commands([c](std::vector<double>& v) { v[c] *= -1; }));
  }
  if (const auto& timeout_s = robot_.motors.command_timeout_s) {
    fault("command_timeout", {"commands_on_change"},
          "commands that hold until the next (their log keeps changes alone)",
          "Give no cmd_vel_timeout with such a log.", hold_commands(*timeout_s));
  }
  const RobotWheel* wheel = driven_wheel(robot_);
  for (const CommandUnit& unit : kCommandUnits) {
    if (unit.of != robot_.command) continue;
    if (unit.factor == kByRadius && (wheel == nullptr || !wheel->radius_m)) continue;
    const double factor = unit.factor == kByRadius ? 1 / *wheel->radius_m : unit.factor;
    const auto of_it = mapped(robot_.channels, [&](const std::string& channel) {
      return channel.starts_with(unit.channel);
    });
    fault("unit_error", {"command_units", unit.alias},
          std::string("the unit of the ") + unit.thing + ": " + unit.name,
          "Multiply them by " + std::to_string(factor) + ".",
          scale_commands(of_it, factor, unit.beyond));
  }
}

void Catalogue::wrong_poses() {
  const auto diagonal = [](double x, double y, double theta) -> Eigen::Matrix3d {
    return Eigen::Vector3d(x, y, theta).asDiagonal();
  };
  fault("heading_flipped", {"heading_sign"}, "the sign of the headings", "Turn the sign of theta.",
        change_poses(diagonal(1, 1, -1)));
  fault("heading_flipped", {"heading_offset"}, "headings that count clockwise from north (y)",
        "Take theta from pi / 2.", change_poses(diagonal(1, 1, -1), -pi / 2))
      .of_world = true;
  fault("axes_mirrored", {"axes_swapped"}, "a world frame that is left-handed",
        "Turn the sign of y, and that of theta when it follows the robot's turns the wrong way.",
        change_poses(diagonal(1, -1, 1)));
  Eigen::Matrix3d swapped = diagonal(0, 0, 1);
  swapped(0, 1) = swapped(1, 0) = 1;
  // Of increments the same as mirrored ones of a sensor that looks another way.
  fault("axes_swapped", {"axes_mirrored"}, "x and y of the poses", "Swap the columns x and y.",
        change_poses(swapped))
      .of_world = true;
  fault("heading_unit", {"unit_error"}, "headings in degrees", "Multiply theta by pi / 180.",
        change_poses(diagonal(1, 1, pi / 180)))
      .radians = pi / 180;
  // asin() of a quaternion's z.
  fault("heading_unit", {"unit_error"}, "headings that are half of what they should be",
        "Double theta.", change_poses(diagonal(1, 1, 2)))
      .radians = 2;
  for (const double turn : {pi / 2, -pi / 2, pi}) {
    fault("heading_turned", {"marker_yaw", "heading_offset"},
          "headings that count from another axis, " + std::to_string(std::lround(turn * 180 / pi)) +
              " degrees on",
          "State the marker's yaw.", change_poses(diagonal(1, 1, 1), turn))
        .of_world = true;
  }
  for (const auto& [unit, metres] : {std::pair{"millimetres", 0.001},
                                     {"centimetres", 0.01},
                                     {"decimetres", 0.1},
                                     {"inches", 0.0254},
                                     {"feet", 0.3048}}) {
    fault("unit_error", {"pose_units", "pose_scale"}, std::string("positions in ") + unit,
          "Multiply x and y by " + std::to_string(metres) + ".",
          change_poses(diagonal(metres, metres, 1)))
        .metres = metres;
  }
}

void Catalogue::wrong_increments() {
  fault("increments_in_world", {"axes_turned"},
        "the axes of the increments: they are the world's, not the robot's",
        "Turn x and y of each increment by less the heading before it.",
        change_increments([](const Pose& before, const Pose& X) {
          return Pose{before.x + X.x, before.y + X.y, wrap_angle(before.theta + X.theta)};
        }))
      .of_increments = true;
}

}  // namespace gapfarm
