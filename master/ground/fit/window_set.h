// Windows of several horizons, and what else a log holds against a robot's motion: a gyro, returns
// to where a run began.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/recordings/windows.h"
#include "common/robot/robot.h"
#include "common/score/kinematic.h"

namespace gapfarm {

// What a window's end is held against.
enum class Sense : char { kPose, kGyro, kReturn };

// A horizon that every way between two poses is longer than, s.
inline constexpr double kEachRow_s = 1e-3;

// The gyro's ratio to what it should measure, among the rows of a fit.
inline constexpr const char* kGyroScale = "gyro_scale";

// The marker is back where the first pose of its run has it.
struct Return {
  Eigen::Vector3d variance;  // as stated: m^2, m^2, rad^2
  // What its way adds: these times the squared scales of the first horizon, where wheels that roll
  // do not slip less.
  Eigen::Matrix3d of_way = Eigen::Matrix3d::Zero();
  Eigen::Vector3d of_slip = Eigen::Vector3d::Zero();  // m^2, m^2, rad^2
};

// Residuals share scales by horizon and component.  The horizons of a gyro lie behind those of the
// poses, then each return has one of its own.
struct WindowSet {
  std::vector<CommandedRun> runs;
  std::vector<Trial> trials;
  std::vector<int> horizon;         // of each trial
  std::vector<int> block;           // of each trial: what is held out or resampled together
  std::vector<std::size_t> run_of;  // of each trial: its run in the log
  int horizons = 0;
  int lengths = 0;                // of the poses' windows: the first horizons
  std::vector<double> lengths_s;  // of each of these, as asked for; 0: whole runs
  int blocks = 0;
  std::vector<int> run_blocks;  // of each run: its first block; those of one run follow each other
  // Of each trial, in its end's axes (m^2, m rad, rad^2); empty: the log does not say.
  std::vector<Eigen::Matrix3d> noise;
  // What every window errs by beside that (slip, timing), of the middle window's stated variance.
  double least_noise = 0.1;
  // Of a window, what gaps are counted by: of single rows the share of a usual window that they
  // last.
  double counts = 1;
  std::vector<double> turned_rad;  // of each trial by the gyro, its bias in; empty: there is none
  std::vector<Return> returns;
  Eigen::Vector2d origin_m = Eigen::Vector2d::Zero();  // the middle of where trials begin
  bool by_speed = true;  // of throttled robots: ends err along their way above all
  // The trials' measured ends as a simulation expects them, at each of some values; empty: as the
  // robot's kinematics do.
  std::function<std::vector<std::vector<Pose>>(const std::vector<Kinematics>&)> simulated = {};

  void add(Trial trial, int of_horizon, std::size_t of_run) {
    trials.push_back(std::move(trial));
    horizon.push_back(of_horizon);
    run_of.push_back(of_run);
  }
  Sense sense_of(std::size_t trial) const {
    if (horizon[trial] < lengths) return Sense::kPose;
    return horizon[trial] < horizons - static_cast<int>(returns.size()) ? Sense::kGyro
                                                                        : Sense::kReturn;
  }
  int blocks_of(std::size_t run) const {
    return (run + 1 < run_blocks.size() ? run_blocks[run + 1] : blocks) - run_blocks[run];
  }
  // "0.5 s": how long windows of a horizon are, by poses or the gyro.
  std::string length_text(int of_horizon) const;
  // Windows of poses a horizon: how often the log says something anew.
  double stretches() const;
};

// Windows of poses of each length that fits, without blocks; `restarts`: each has a run of its own
// (restart_at_measured_speed()); `once`: those that are the same as of the length before are
// omitted.  Errors: no window fits.
Result<WindowSet> pose_windows(const RunLog& log, const WindowSettings& settings, bool restarts,
                               bool once);

// The same with all else.  Blocks are runs, or stretches of them where there are fewer than ten.
// Windows of robots with a throttle restart (common/recordings/windows.h).  Errors: no window fits.
Result<WindowSet> window_set(const GroundRobot& robot, const RunLog& log,
                             const WindowSettings& settings);

}  // namespace gapfarm
