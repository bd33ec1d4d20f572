// Driving a list of commands or way-points many times with a model's own spread.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/ranges.h"
#include "common/math/path_distance.h"
#include "common/score/baselines.h"
#include "common/score/motion_model.h"
#include "master/farm/farm.h"

namespace gapfarm {

constexpr double kLongestCommand_s = 60;  // that a worker drives

// One command of one run.
struct Leg {
  CommandSpec command;
  std::vector<PathSample> path;  // world frame, t since the command began; from start to rest
};
using DrivenRun = std::vector<Leg>;

// Drives one command in every run, each from where it stands: one leg a start, in their order.
// Errors: a command that the mover does not know, of the farm.
struct MoverStart {
  Pose X_WS;
  CommandSpec command;
  std::uint64_t run = 0, leg = 0;  // name the draw of noise
};
using Mover = std::function<Result<std::vector<Leg>>(std::span<const MoverStart> starts)>;

struct DriveSettings {
  std::uint64_t seed = 1;
  double interval_s = 0.05;  // between samples of a path
  // World position that the problem's places count from (a model's [frame]), m.
  double frame_x_m = 0, frame_y_m = 0;
};

// The simulation with its drive noise; poses are the true ones, without the camera's noise.
// `farm` and `problem` outlive it.
Mover simulated_mover(Farm& farm, const Problem& problem, const DriveSettings& settings);
// Constant speed and turn rate; no spread.
Mover constant_velocity_mover(std::vector<ConstantVelocity> models, const DriveSettings& settings);
// Ends drawn from the mined distributions, straight or circular paths between; a command that lasts
// longer or shorter than the mined one has its mean and covariance scaled with time.
Mover mined_mover(const MotionModel& model, const DriveSettings& settings);

// Constant velocities of the model itself: its nominal motions of the commands.
Result<std::vector<ConstantVelocity>> nominal_velocities(Farm& farm, const Problem& problem);

// `runs` times the whole list from `X_WS`, poses as a camera measures them: what a log of it would
// hold.  Errors: of the farm, a run that does not end well.
Result<std::vector<DrivenRun>> drive_commands(Farm& farm, const Problem& problem, const Pose& X_WS,
                                              const std::vector<CommandSpec>& commands,
                                              unsigned runs, const DriveSettings& settings);

// The same by a mover, leg by leg.
Result<std::vector<DrivenRun>> drive_commands(const Mover& mover, const Pose& X_WS,
                                              const std::vector<CommandSpec>& commands,
                                              unsigned runs);

// What a way-point driver knows of the robot: how to turn and go ahead, and how fast that is.
struct WaypointPilot {
  ConstantVelocity forward, left, right;
};
// Out of the models' commands: the straightest that goes ahead and the two that turn most on the
// spot.  Error: there are none.
Result<WaypointPilot> make_pilot(std::span<const ConstantVelocity> models);

// For each target in turn: turn toward it, then go as far as it is, by the pilot's rates.  Every
// run looks where it stands before each command, as a robot under a camera does.
// Errors: of the mover, a turn or a way that takes longer than kLongestCommand_s.
Result<std::vector<DrivenRun>> drive_waypoints(const Mover& mover, const WaypointPilot& pilot,
                                               const Pose& X_WS,
                                               std::span<const Eigen::Vector2d> targets,
                                               unsigned runs);

// What came of driving, as text, CSV and a page.

// A run at equal shares of each leg's time, so that runs correspond point by point.
struct GridPoint {
  std::size_t leg = 0;
  double share = 0;  // of the leg's time to rest
  Pose pose;
};
// REQUIRES: every leg has a path.
std::vector<GridPoint> on_grid(const DrivenRun& run, unsigned points_a_leg);

struct BandPoint {
  std::size_t leg = 0;
  double share = 0;
  Pose middle;                   // medians
  Eigen::Vector3d below, above;  // from the middle to the band's ends: m, m, rad
};

// A band of x, y and heading that holds a whole path with probability `coverage`: at every point at
// once, not point by point.  Its shape, from each point's 5 % and 95 % quantiles, comes from half
// of the runs; one factor, from the other half's greatest excursions, widens it until it holds
// enough of them (split conformal; Lei et al., JASA 2018), so that it is not fitted to what it is
// judged by.
// REQUIRES: at least 4 runs with the same legs, coverage in (0, 1).
std::vector<BandPoint> path_band(std::span<const DrivenRun> runs, double coverage);
// Greatest excursion of a run in units of the band: at most 1 when all of it lies inside.
double excursion(const std::vector<BandPoint>& band, const DrivenRun& run);

// Where runs end: mean, and the ellipse of x and y that holds `coverage` of a normal distribution.
struct EndEllipse {
  Pose mean;
  Eigen::Matrix2d covariance;  // m^2, world axes
  double heading_deviation_rad = 0;
  double major_m = 0, minor_m = 0;  // half axes
  double direction_rad = 0;         // of the major one
};
// REQUIRES: at least two runs.
EndEllipse end_ellipse(std::span<const DrivenRun> runs, double coverage);

// The run's way on the floor with points at least `spacing_m` apart, and its end.
std::vector<PathPoint> floor_path(const DrivenRun& run, double spacing_m);
std::vector<PathPoint> floor_path(std::span<const PathSample> path, double spacing_m);

// Over runs, m.
struct RunDistance {
  double median = 0;
  Interval middle_90;  // 5 % and 95 %
};

// Of one driver's runs to a real path, by each of kPathDistances.
using RealDistances = std::array<RunDistance, kPathDistances.size()>;
RealDistances distances_to(std::span<const DrivenRun> runs, std::span<const PathPoint> real,
                           double spacing_m);

struct DriverReport {
  std::string name;  // "simulation", "constant velocity", ...
  std::vector<DrivenRun> runs;
  std::vector<BandPoint> band;  // empty for a driver without spread
  EndEllipse end;
  std::optional<RealDistances> real;
};

struct DriveReport {
  double coverage = 0.9;
  std::vector<DriverReport> drivers;
  std::vector<PathPoint> real;                   // on the floor; empty: none
  std::vector<Eigen::Vector2d> targets;          // empty: a list of commands
  std::optional<RealDistances> real_to_targets;  // of the straight lines between the targets
};

std::string drive_text(const DriveReport& report);
std::string band_csv(const DriveReport& report);
std::string ends_csv(const DriveReport& report);
std::string drive_page(const DriveReport& report, const std::string& title);

}  // namespace gapfarm
