#include "worker/sim/robot/step_plan.h"

#include <algorithm>

namespace gapfarm {
namespace {

// A remainder below this share of a step joins the step before it.
constexpr double kLeastShare = 1e-3;

}  // namespace

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
