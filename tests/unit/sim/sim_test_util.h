// Commands and measures that the simulation tests share.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "worker/scenarios/srv1/srv1_robot.h"
#include "worker/sim/robot/simulator.h"

namespace gapfarm {

inline constexpr double kFullSpeed_m_s = 0.28;

struct Command {
  const char* name;
  double left, right;  // duty
};

// Each command is followed by its mirror image but for the first two, which are their own.
inline constexpr std::array<Command, 6> kCommands{{{"forward", 1, 1},
                                                   {"backward", -1, -1},
                                                   {"turn_ccw", -0.3, 0.3},
                                                   {"turn_cw", 0.3, -0.3},
                                                   {"wide_ccw", 0.4, 1.0},
                                                   {"wide_cw", 1.0, 0.4}}};

inline DriveInput drive_at(double left_m_s, double right_m_s, double duration_s = 1) {
  DriveInput drive;
  drive.left.speed_m_s = left_m_s;
  drive.right.speed_m_s = right_m_s;
  drive.duration_s = duration_s;
  return drive;
}

inline DriveInput drive_of(const Command& command, double duration_s = 1) {
  return drive_at(command.left * kFullSpeed_m_s, command.right * kFullSpeed_m_s, duration_s);
}

inline DriveInput mirrored(DriveInput drive) {
  std::swap(drive.left, drive.right);
  return drive;
}

inline SimSettings srv1_settings() {
  const ParameterValues values = srv1_table().nominal();
  return sim_settings(srv1_robot().size(), values, ActiveEffects(srv1_table(), values));
}

inline double degrees(double rad) { return rad * 180 / std::numbers::pi; }
inline double radians(double deg) { return deg * std::numbers::pi / 180; }

inline Motion run_once(const SimSettings& settings, const DriveInput& drive,
                       const Floor& floor = {}) {
  return Simulator(settings).run(drive, floor);
}

inline double distance_m(const Pose& a, const Pose& b) { return std::hypot(a.x - b.x, a.y - b.y); }

// Every bit of two results agrees.
inline bool same(const Motion& a, const Motion& b) {
  return a.outcome == b.outcome && a.X_SE == b.X_SE && a.rest_time_s == b.rest_time_s &&
         a.duration_s == b.duration_s && a.max_roll_rad == b.max_roll_rad &&
         a.max_pitch_rad == b.max_pitch_rad && a.max_heave_m == b.max_heave_m;
}

}  // namespace gapfarm
