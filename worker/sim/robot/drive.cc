#include "worker/sim/robot/drive.h"

#include <algorithm>
#include <cmath>

namespace gapfarm {
namespace {

// A remainder below this share of a step joins the step before it.
constexpr double kLeastShare = 1e-3;

}  // namespace

SideMotion::SideMotion(const SideDrive& drive, double duration_s)
    : drive_(drive), duration_s_(duration_s), still_s_(duration_s) {
  stop_travel_m_ = motor_travel(duration_s);
  if (drive.lag_s <= 0) return;
  stop_speed_m_s_ = -drive.speed_m_s * std::expm1(-duration_s / drive.lag_s);
  const double speed = std::abs(stop_speed_m_s_);
  if (speed > kStillSpeed_m_s) still_s_ += drive.lag_s * std::log(speed / kStillSpeed_m_s);
}

// ds/dt = (target - s) / lag, with the target at speed until the duration and zero after it.
double SideMotion::motor_travel(double t_s) const {
  const double lag = drive_.lag_s;
  if (lag <= 0) return drive_.speed_m_s * std::min(t_s, duration_s_);
  if (t_s <= duration_s_) return drive_.speed_m_s * (t_s + lag * std::expm1(-t_s / lag));
  return stop_travel_m_ - stop_speed_m_s_ * lag * std::expm1(-(t_s - duration_s_) / lag);
}

double SideMotion::travel(double t_s) const {
  const double travel = motor_travel(t_s);
  return std::copysign(std::max(0.0, std::abs(travel) - drive_.dead_travel_m), travel);
}

double SideMotion::onset_time() const {
  const double dead = drive_.dead_travel_m;
  if (dead <= 0 || std::abs(motor_travel(still_s_)) <= dead) return 0;
  double before = 0;
  double after = still_s_;
  for (int i = 0; i < 60; ++i) {  // to the last bit: travel is monotonic
    const double middle = (before + after) / 2;
    (std::abs(motor_travel(middle)) > dead ? after : before) = middle;
  }
  return after;
}

StepPlan::StepPlan(double step_s, const SideMotion& left, const SideMotion& right,
                   double duration_s)
    : step_s_(step_s), events_{left.onset_time(), right.onset_time(), duration_s} {
  std::sort(events_.begin(), events_.end());
}

void StepPlan::advance() {
  start_s_ += length_s_;
  length_s_ = step_s_;
  while (next_event_ < events_.size() && events_[next_event_] - start_s_ < kLeastShare * step_s_) {
    start_s_ = phase_start_s_ = std::max(phase_start_s_, events_[next_event_]);
    step_ = 0;
    ++next_event_;
  }
  // From the event, not from step to step: rounding does not add up.
  start_s_ = phase_start_s_ + static_cast<double>(step_++) * step_s_;
  if (next_event_ == events_.size()) return;
  const double left_s = events_[next_event_] - start_s_;
  if (left_s < (1 + kLeastShare) * step_s_) length_s_ = left_s;
}

}  // namespace gapfarm
