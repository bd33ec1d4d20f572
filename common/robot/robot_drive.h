// From logged commands to what each wheel does: the controller's kinematics and the motor side.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "common/recordings/run.h"
#include "common/robot/robot.h"

namespace gapfarm {

// What a wheel does over one step.
struct WheelMotion {
  double speed_m_s = 0;    // mean speed of its surface, positive when it rolls along its heading
  double heading_rad = 0;  // of rolling, in the robot's frame, the steering included
};

// The mean of piecewise constant commands over a step, so that what is commanded between two steps
// counts by how long it was commanded.
class CommandTrack {
 public:
  // `rows` outlive the track.  Before the first row its values count; after `timeout_s` without a
  // new row zeros do.
  CommandTrack(std::span<const CommandRow> rows, std::size_t channels,
               std::optional<double> timeout_s);

  // REQUIRES: times that do not go back, dt_s > 0.
  const std::vector<double>& mean(double t_s, double dt_s);
  // First time beyond `t_s` and before `until_s` from which something else is commanded; none:
  // `until_s`.
  double next_change(double t_s, double until_s) const;
  // First time from `t_s` on at which a value is not zero; infinity when none is.
  double next_motion(double t_s) const;

 private:
  std::span<const CommandRow> rows_;
  std::optional<double> timeout_s_;
  std::size_t row_ = 0;
  std::vector<double> mean_;
};

// What the floor does to what a throttle makes of its commands, m/s^2.
struct FloorForces {
  double downhill = 0;  // ahead, by the robot's weight
  double resists = 0;   // more than the robot's own dry friction
};

class RobotDrive {
 public:
  // `robot` is complete and outlives this, as do the commands.  A throttle begins at `speed_m_s`,
  // motors at the speed that the first step's commands ask for.
  RobotDrive(const GroundRobot& robot, std::span<const CommandRow> commands, double speed_m_s = 0);

  // Over [t_s, t_s + dt_s], one a wheel of the robot.  `yaw_rate_rad_s` is the robot's own.
  // REQUIRES: steps that follow one another.
  std::span<const WheelMotion> advance(double t_s, double dt_s, double yaw_rate_rad_s);
  // The same without the wheels of a steered robot: its curvature() and traction_m_s() alone.
  std::span<const WheelMotion> advance_motors(double t_s, double dt_s, double yaw_rate_rad_s,
                                              const FloorForces& floor = {});

  // When the wheels are commanded something else, before `until_s`.
  double next_change(double t_s, double until_s) const;
  // Whether the wheels stand and are commanded to; and when the command differs.
  bool stands() const { return stands_; }
  double next_motion(double t_s) const;

  // Curvature (1/m) that the steering asks for over the last step, and the speed of the traction
  // axle's middle (m/s).  Steered robots only.
  double curvature() const { return curvature_; }
  double traction_m_s() const { return traction_m_s_; }

 private:
  void wheel_targets(const std::vector<double>& commanded);
  void twist_targets(double v, double omega, double vy);
  double steer(double wanted_rad, double dt_s);  // the mean angle of the step, rad
  double throttle(double commanded, double dt_s, double yaw_rate_rad_s, const FloorForces& floor);
  void place_on_curve();
  double follow(std::size_t wheel, double target_m_s, double dt_s);
  double angle_of(double command) const;
  double dead(double value) const;

  const GroundRobot& robot_;
  CommandTrack track_;
  bool steered_;
  double rolls_ = 1;  // m/s a unit of a steered robot's commanded speed
  double wheel_lag_s_;
  std::vector<int> channel_;  // of each wheel; -1: none
  int v_ = -1, omega_ = -1, vy_ = -1, throttle_ = -1, speed_ = -1, steering_ = -1;
  std::vector<double> targets_;  // m/s of each wheel
  std::vector<double> limited_;  // behind the acceleration limit
  std::vector<double> speeds_;   // behind the lag
  std::vector<WheelMotion> motions_;
  bool fresh_ = true;
  bool stands_ = false;
  double steering_rad_ = 0;
  double tangent_of_rad_ = 0, tangent_ = 0;
  double curvature_ = 0;
  double traction_m_s_ = 0;
  double throttle_m_s_ = 0;
  double decayed_s_ = 0, decay_ = 1;  // what a gap that lags falls to in the last step's time
};

}  // namespace gapfarm
