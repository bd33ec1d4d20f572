#include "worker/sim/robot/simulator.h"

#include <algorithm>
#include <cmath>

#include "worker/sim/observe.h"
#include "worker/sim/world.h"

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

namespace {

constexpr double kTimeSlack_s = 1e-9;  // rounding of step times

}  // namespace

Simulator::Simulator(const SimSettings& settings, StepCounter* steps)
    : settings_(settings), world_(std::make_unique<RobotWorld>(settings)), watched_(steps) {}
Simulator::~Simulator() = default;

MotionSample Simulator::sample(double t_s) {
  const btTransform& X_SB = world_->robot().body().getWorldTransform();
  const btVector3 centre = world_->robot().turning_centre();
  return {t_s, pose_of(X_SB, centre), (X_SB * centre).z(), world_->robot().kinetic_energy()};
}

Motion Simulator::run(const DriveInput& drive, const Floor& floor, std::vector<MotionSample>* path,
                      double interval_s) {
  world_->reset(floor);
  const SideMotion left(drive.left, drive.duration_s);
  const SideMotion right(drive.right, drive.duration_s);
  const double still_s = std::max(left.still_time(), right.still_time());
  StepPlan plan(1 / (settings_.step_rate_hz * settings_.sub_steps), left, right, drive.duration_s);
  const btRigidBody& body = world_->robot().body();
  const btVector3 centre = world_->robot().turning_centre();

  Motion motion;
  motion.outcome = MotionOutcome::kNeverRested;
  PathRecorder recorder(path, interval_s);
  if (recorder.wanted()) recorder.add(sample(0));
  double rest_s = 0;
  double t = 0;
  while (t < still_s + kSettleLimit_s) {
    const btTransform before = body.getWorldTransform();
    plan.advance();
    t = plan.start_s();
    const double dt = plan.length_s();
    world_->step({left.mean_speed(t, dt), right.mean_speed(t, dt)}, dt);
    ++steps_;
    count_step(watched_);
    const bool stopped = t >= still_s - kTimeSlack_s;
    t = plan.end_s();
    const btTransform& now = body.getWorldTransform();
    if (!is_sane(body.getLinearVelocity(), body.getAngularVelocity())) {
      motion.outcome = MotionOutcome::kDiverged;
      break;
    }
    keep_extremes(now.getBasis(), (now * centre).z(), motion);
    if (recorder.wanted()) recorder.add(sample(t));
    if (has_fallen(now.getBasis())) {
      motion.outcome = MotionOutcome::kFellOver;
      break;
    }
    rest_s = stopped && is_still(before, now, dt) ? rest_s + dt : 0;
    if (rest_s >= kRestTime_s) {
      motion.outcome = MotionOutcome::kOk;
      break;
    }
  }
  motion.duration_s = t;
  turn_into_angles(motion);
  if (motion.outcome == MotionOutcome::kDiverged) return motion;
  motion.X_SE = pose_of(body.getWorldTransform(), centre);
  motion.rest_time_s = std::max(0.0, t - rest_s - drive.duration_s);
  recorder.finish();
  return motion;
}

}  // namespace gapfarm
