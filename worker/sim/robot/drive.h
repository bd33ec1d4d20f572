// What a side's motor makes of a command: the travel of the tread surface over time, in closed
// form. The world asks for the average speed over a step, so the distance driven is exact and
// continuous in every parameter whatever the step is, also when the motors stop within a step.
#pragma once

#include "worker/sim/robot/motion.h"

namespace gapfarm {

class SideMotion {
 public:
  // REQUIRES: duration_s >= 0, lag_s >= 0, dead_travel_m >= 0.
  SideMotion(const SideDrive& drive, double duration_s);

  // Travel of the tread surface from 0 to `t_s`, signed, m; non-decreasing in magnitude.  It tends
  // to speed * duration, less the dead travel: what the lag loses at the start it gives back
  // after the stop.
  double travel(double t_s) const;
  // Average speed of the tread surface over [t_s, t_s + dt_s], m/s.
  double mean_speed(double t_s, double dt_s) const {
    return (travel(t_s + dt_s) - travel(t_s)) / dt_s;
  }
  // Time at which the surface begins to move, s: 0 without dead travel, or when it never does.
  double onset_time() const;
  // Time after which the motor runs slower than kStillSpeed_m_s, s; at least the duration.
  double still_time() const { return still_s_; }

  // The surface covers kStillSpeed_m_s * lag at most after still_time(): a few micrometres.
  static constexpr double kStillSpeed_m_s = 3e-5;

 private:
  double motor_travel(double t_s) const;

  SideDrive drive_;
  double duration_s_;
  double stop_speed_m_s_ = 0;  // when the motors are commanded to stop
  double stop_travel_m_ = 0;
  double still_s_ = 0;
};

}  // namespace gapfarm
