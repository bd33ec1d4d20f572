// When physics steps begin and end.
#pragma once

#include <array>

#include "worker/sim/robot/drive.h"

namespace gapfarm {

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

}  // namespace gapfarm
