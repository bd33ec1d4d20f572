// One world with one robot, used again and again.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "worker/sim/robot/motion.h"
#include "worker/sim/step_counter.h"

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

// Steps of the rate's length, but for a shorter one before each event (the motors stop, a tread
// with dead travel begins to move), so that events fall between two steps.  Sliding friction does
// not feel how fast the surface is, so an event within a step would be rounded to a whole step, and
// the end pose would be a staircase over duration and dead travel.
class StepPlan {
 public:
  StepPlan(double step_s, const SideMotion& left, const SideMotion& right, double duration_s);

  // Goes on to the next step; start and length hold for it until the next call.
  void advance();
  double start_s() const { return start_s_; }
  double end_s() const { return start_s_ + length_s_; }
  double length_s() const { return length_s_; }

 private:
  double step_s_;
  std::array<double, 3> events_;  // ascending
  std::size_t next_event_ = 0;
  double phase_start_s_ = 0;  // the last event
  long step_ = 0;             // steps begun since then
  double start_s_ = 0;
  double length_s_ = 0;
};

class RobotWorld;

// Deterministic to the bit: run() gives the same answer as the first run() of a new simulator with
// the same settings in a new process, whatever was run before.  One thread at a time.
class Simulator {
 public:
  // REQUIRES: settings within the bounds of the parameter table.
  // `steps` (may be null) outlives the simulator and shows from outside that it advances.
  explicit Simulator(const SimSettings& settings, StepCounter* steps = nullptr);
  ~Simulator();
  Simulator& operator=(Simulator&&) = delete;

  const SimSettings& settings() const { return settings_; }

  // Drives from rest at the origin of S until the robot rests again.  When `path` is given, it
  // receives a sample every `interval_s` from t = 0, and one at rest.
  Motion run(const DriveInput& drive, const Floor& floor, std::vector<MotionSample>* path = nullptr,
             double interval_s = 0);

  // Taken since construction (benchmarks only).
  std::uint64_t steps() const { return steps_; }

 private:
  MotionSample sample(double t_s);

  SimSettings settings_;
  std::unique_ptr<RobotWorld> world_;
  std::uint64_t steps_ = 0;
  StepCounter* watched_;
};

}  // namespace gapfarm
