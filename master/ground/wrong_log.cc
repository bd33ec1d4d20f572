// Logs that are the wrong way round, or in another unit.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/ranges.h"
#include "master/ground/hypotheses.h"

namespace gapfarm {
namespace {

using std::numbers::pi;

using PutRight = std::function<void(RunLog*)>;
using Faults = std::vector<GroundHypothesis>;

GroundHypothesis fault(const std::string& name, std::vector<std::string> aliases,
                       const std::string& thing, const std::string& remedy, PutRight put_right) {
  return {name, std::move(aliases), thing, {}, std::move(put_right), 1, remedy};
}

constexpr double kMostTimes = 10'000;  // a run's clock may have been set in between
// Of controllers, as people set them.
constexpr double kTimeouts_s[] = {0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5,
                                  0.6, 0.75, 0.8, 1,    1.2, 1.5, 2};

// Changes the values of every row of commands.
PutRight change_commands(std::function<void(std::vector<double>&)> change) {
  return [change = std::move(change)](RunLog* log) {
    for (LoggedRun& run : log->runs) {
      for (CommandRow& row : run.commands) change(row.values);
    }
  };
}

// The poses of a relative log, each anew from the new one before it and the increment as logged.
PutRight change_increments(std::function<Pose(const Pose& before, const Pose& increment)> next) {
  return [next = std::move(next)](RunLog* log) {
    for (LoggedRun& run : log->runs) {
      Pose before, after;
      for (PoseRow& row : run.poses) {
        after = next(after, between(before, row.X_WM));
        before = std::exchange(row.X_WM, after);
      }
    }
  };
}

// L (x, y, theta), the heading `turn` (rad) less; of relative poses L of each increment, whose
// noise goes with it.
PutRight change_poses(const Eigen::Matrix3d& L, double turn = 0) {
  const auto changed = [L, turn](const Pose& X) {
    const Eigen::Vector3d v = L * Eigen::Vector3d(X.x, X.y, X.theta);
    return Pose{v[0], v[1], turn == 0 ? v[2] : wrap_angle(v[2] - turn)};
  };
  const auto chained = change_increments(
      [changed](const Pose& before, const Pose& X) { return before * changed(X); });
  return [L, changed, chained](RunLog* log) {
    if (log->relative) chained(log);
    for (LoggedRun& run : log->runs) {
      for (PoseRow& row : run.poses) {
        if (!log->relative) row.X_WM = changed(row.X_WM);
        if (row.noise) *row.noise = (L * *row.noise * L.transpose()).eval();
      }
    }
  };
}

// Puts rows in place of each command, as it acts from then on until the next or the last pose.
PutRight act_out(
    std::function<void(const CommandRow&, double until_s, std::vector<CommandRow>*)> act) {
  return [act = std::move(act)](RunLog* log) {
    for (LoggedRun& run : log->runs) {
      std::vector<CommandRow> acted;
      for (std::size_t i = 0; i < run.commands.size(); ++i) {
        const CommandRow& row = run.commands[i];
        const double last_s = run.poses.empty() ? row.t_s : run.poses.back().t_s;
        act(row, i + 1 < run.commands.size() ? run.commands[i + 1].t_s : last_s, &acted);
      }
      run.commands = std::move(acted);
    }
  };
}

// Repeats each command every `step_s`, as its sender did.
PutRight hold_commands(double step_s) {
  return act_out([step_s](const CommandRow& row, double until_s, std::vector<CommandRow>* to) {
    const double times = std::clamp((until_s - row.t_s) / step_s, 0.0, kMostTimes);
    for (int k = 0; k <= times; ++k) to->push_back({row.t_s + k * step_s, row.values});
  });
}

// Stops the robot so long after each command.
PutRight stop_after(double timeout_s) {
  return act_out([timeout_s](const CommandRow& row, double until_s, std::vector<CommandRow>* to) {
    to->push_back(row);
    const double stops_s = row.t_s + timeout_s;
    if (stops_s < until_s) to->push_back({stops_s, std::vector<double>(row.values.size(), 0.0)});
  });
}

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
PutRight scale_commands(const std::vector<bool>& of, double factor, double beyond) {
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

Faults wrong_commands(const GroundRobot& robot) {
  Faults all;
  const auto pairs = channel_pairs(robot);
  const auto turned = [&](const char* name, const std::string& thing,
                          std::function<void(std::vector<double>&)> turn) {
    all.push_back(fault(name, {"command_sign"}, "the sign of " + thing,
                        "Turn the sign of that column.", change_commands(std::move(turn))));
  };
  if (!pairs.empty()) {
    all.push_back(fault("sides_swapped", {}, "left and right of the commands",
                        "Swap the columns of the two sides.", swap_commands(pairs)));
    for (const bool left : {true, false}) {
      turned("side_reversed", std::string("the ") + (left ? "left" : "right") + " side",
             [pairs, left](std::vector<double>& v) {
               for (const auto& [l, r] : pairs) v[left ? l : r] *= -1;
             });
    }
  }
  // A robot of wheels that push it several ways has a column for each.
  const bool one_a_wheel = is_holonomic(robot) && robot.command != kTwists;
  const auto turn_column = [&](const char* name, std::size_t c) {
    turned(name, robot.channels[c], [c](std::vector<double>& v) { v[c] *= -1; });
  };
  for (std::size_t c = 0; c < robot.channels.size(); ++c) {
    if (one_a_wheel) turn_column("side_reversed", c);
    for (std::size_t d = c + 1; d < robot.channels.size(); ++d) {
      if (!one_a_wheel && !pairs.empty()) continue;
      all.push_back(fault("channels_swapped", {"sides_swapped"},
                          robot.channels[c] + " and " + robot.channels[d] + " of the commands",
                          "Swap these two columns.", swap_commands({{c, d}})));
    }
  }
  turned("command_reversed", "every command", [](std::vector<double>& v) {
    for (double& value : v) value = -value;
  });
  all.back().remedy = "Turn the sign of the commands.";
  constexpr std::string_view kOfNoWheel[] = {"steering", "omega", "vy", "v", "speed", "throttle"};
  for (std::size_t c = 0; c < robot.channels.size(); ++c) {
    const std::string& channel = robot.channels[c];
    if (!contains(kOfNoWheel, channel)) continue;
    const bool turns = channel == "steering" || channel == "omega";
    turn_column(turns ? "steering_reversed" : "command_reversed", c);
    if (turns || channel == "vy") continue;
    all.back().aliases.emplace_back("heading_turned");
    all.back().remedy += " If the tracked point heads backward instead, state the marker's yaw.";
  }
  const auto& stated_s = robot.motors.command_timeout_s;
  if (stated_s) {
    all.push_back(fault("command_timeout", {"commands_on_change"},
                        "commands that hold until the next (their log keeps changes alone)",
                        "Give no cmd_vel_timeout with such a log.", hold_commands(*stated_s)));
  }
  for (const double timeout_s : kTimeouts_s) {
    if (stated_s || robot.measured) break;
    all.push_back(fault("command_timeout", {"commands_on_change"},
                        fmt::format("commands that act for {:g} s and no longer", timeout_s),
                        fmt::format("Give the robot's file cmd_vel_timeout = {:g}.", timeout_s),
                        stop_after(timeout_s)));
  }
  return all;
}

Faults wrong_units_of_commands(const GroundRobot& robot) {
  Faults all;
  const RobotWheel* wheel = driven_wheel(robot);
  for (const CommandUnit& unit : kCommandUnits) {
    if (unit.of != robot.command) continue;
    if (unit.factor == kByRadius && (wheel == nullptr || !wheel->radius_m)) continue;
    const double factor = unit.factor == kByRadius ? 1 / *wheel->radius_m : unit.factor;
    const auto of_it = mapped(robot.channels, [&](const std::string& channel) {
      return channel.starts_with(unit.channel);
    });
    all.push_back(fault("unit_error", {"command_units", unit.alias},
                        std::string("the unit of the ") + unit.thing + ": " + unit.name,
                        "Multiply them by " + std::to_string(factor) +
                            (robot.measured ? "; ticks by 2 pi over those of a turn." : "."),
                        scale_commands(of_it, factor, unit.beyond)));
  }
  return all;
}

// Poses that become right by L (x, y, theta), `turn` off the heading.
struct WrongPoses {
  const char *name, *alias, *other, *thing, *remedy;
  double x, y, theta;
  double turn = 0;
  bool swaps = false;     // x and y
  bool of_world = false;  // of increments the same as others of a sensor that looks another way
};
constexpr WrongPoses kWrongPoses[] = {
    {"heading_flipped", "heading_sign", "", "the sign of the headings", "Turn the sign of theta.",
     1, 1, -1},
    {"heading_flipped", "heading_offset", "", "headings that count clockwise from north (y)",
     "Take theta from pi / 2.", 1, 1, -1, -pi / 2, false, true},
    {"axes_mirrored", "axes_swapped", "", "a world frame that is left-handed",
     "Turn the sign of y, and that of theta when it follows the robot's turns the wrong way.", 1,
     -1, 1},
    {"axes_swapped", "axes_mirrored", "", "x and y of the poses", "Swap the columns x and y.", 1, 1,
     1, 0, true, true},
    {"heading_unit", "unit_error", "", "headings in degrees", "Multiply theta by pi / 180.", 1, 1,
     pi / 180},
    {"heading_unit", "heading_flipped", "unit_error", "headings in degrees that count clockwise",
     "Multiply theta by -pi / 180.", 1, 1, -pi / 180},
    {"heading_unit", "heading_flipped", "heading_offset",
     "headings in degrees that count clockwise from north (y)",
     "Multiply theta by pi / 180 and take it from pi / 2.", 1, 1, -pi / 180, -pi / 2, false, true},
    // asin() of a quaternion's z.
    {"heading_unit", "unit_error", "", "headings that are half of what they should be",
     "Double theta.", 1, 1, 2},
    {"heading_turned", "marker_yaw", "heading_offset",
     "headings that count from another axis, 90 degrees on", "State the marker's yaw.", 1, 1, 1,
     pi / 2, false, true},
    {"heading_turned", "marker_yaw", "heading_offset",
     "headings that count from another axis, -90 degrees on", "State the marker's yaw.", 1, 1, 1,
     -pi / 2, false, true},
    {"heading_turned", "marker_yaw", "command_reversed",
     "headings that count from another axis, 180 degrees on",
     "State the marker's yaw, or turn the sign of commands ahead if the robot drove backward.", 1,
     1, 1, pi, false, true}};

constexpr std::pair<const char*, double> kLengths[] = {{"millimetres", 0.001},
                                                       {"centimetres", 0.01},
                                                       {"decimetres", 0.1},
                                                       {"inches", 0.0254},
                                                       {"feet", 0.3048}};

}  // namespace

std::vector<GroundHypothesis> wrong_poses() {
  Faults all;
  for (const WrongPoses& w : kWrongPoses) {
    Eigen::Matrix3d L = Eigen::Vector3d(w.x, w.y, w.theta).asDiagonal();
    if (w.swaps) L.row(0).swap(L.row(1));
    std::vector<std::string> aliases = {w.alias, w.other};
    std::erase(aliases, "");
    all.push_back(fault(w.name, std::move(aliases), w.thing, w.remedy, change_poses(L, w.turn)));
    all.back().of_world = w.of_world;
    all.back().radians = std::abs(w.theta);
  }
  for (const auto& [unit, metres] : kLengths) {
    all.push_back(fault("unit_error", {"pose_units", "pose_scale"},
                        std::string("positions in ") + unit,
                        "Multiply x and y by " + std::to_string(metres) + ".",
                        change_poses(Eigen::Vector3d(metres, metres, 1).asDiagonal())));
    all.back().metres = metres;
  }
  return all;
}

std::vector<GroundHypothesis> wrong_sides_of_poses() {
  return {fault("sides_swapped", {"command_sign"}, "the side to which it turns",
                "Exchange left and right in the commands, or mirror the poses.",
                change_poses(Eigen::Vector3d(1, -1, -1).asDiagonal())),
          fault("axes_mirrored", {"axes_swapped"}, "a world frame that is left-handed",
                "Turn the sign of x.", change_poses(Eigen::Vector3d(-1, 1, 1).asDiagonal()))};
}

std::vector<GroundHypothesis> wrong_log(const GroundRobot& robot) {
  Faults all = wrong_commands(robot);
  append(all, wrong_units_of_commands(robot));
  append(all, wrong_poses());
  all.push_back(
      fault("increments_in_world", {"axes_turned"},
            "the axes of the increments: they are the world's, not the robot's",
            "Turn x and y of each increment by less the heading before it.",
            change_increments([](const Pose& before, const Pose& X) {
              return Pose{before.x + X.x, before.y + X.y, wrap_angle(before.theta + X.theta)};
            })));
  all.back().of_increments = true;
  return all;
}

}  // namespace gapfarm
