// Driving a list of commands or way-points many times with a model's own spread.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "common/score/constant_velocity.h"
#include "common/score/motion_model.h"
#include "master/farm/farm.h"

namespace gapfarm {

// One command of one run.
struct Leg {
  CommandSpec command;
  std::vector<PathSample> path;  // world frame, t since the command began; from start to rest
};
using DrivenRun = std::vector<Leg>;

// Moves a path along the world's axes, m.
void move_path(double dx_m, double dy_m, std::vector<PathSample>* path);

// Drives one command in every run, each from where it stands.
class Mover {
 public:
  struct Start {
    Pose X_WS;
    CommandSpec command;
    std::uint64_t run = 0, leg = 0;  // name the draw of noise
  };
  virtual ~Mover() = default;
  // One leg a start, in their order.  Errors: a command that the mover does not know, of the farm.
  virtual Result<std::vector<Leg>> drive(std::span<const Start> starts) const = 0;
};

struct DriveSettings {
  std::uint64_t seed = 1;
  double interval_s = 0.05;  // between samples of a path
  // World position that the problem's places count from (a model's [frame]), m.
  double frame_x_m = 0, frame_y_m = 0;
};

// The simulation with its drive noise; poses are the true ones, without the camera's noise.
// `farm` and `problem` outlive it.
std::unique_ptr<Mover> simulated_mover(Farm& farm, const Problem& problem,
                                       const DriveSettings& settings);
// Constant speed and turn rate; no spread.
std::unique_ptr<Mover> constant_velocity_mover(std::vector<ConstantVelocity> models,
                                               const DriveSettings& settings);
// Ends drawn from the mined distributions, straight or circular paths between; a command that lasts
// longer or shorter than the mined one has its mean and covariance scaled with time.
std::unique_ptr<Mover> mined_mover(const MotionModel& model, const DriveSettings& settings);

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
Result<std::vector<DrivenRun>> drive_waypoints(const Mover& mover, const WaypointPilot& pilot,
                                               const Pose& X_WS,
                                               std::span<const Eigen::Vector2d> targets,
                                               unsigned runs);

}  // namespace gapfarm
