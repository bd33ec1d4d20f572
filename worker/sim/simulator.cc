#include "worker/sim/simulator.h"

#include <algorithm>
#include <cmath>

#include "worker/sim/drive.h"
#include "worker/sim/step_plan.h"
#include "worker/sim/world.h"

namespace gapfarm {
namespace {

// At rest: slower than these, as seen from one step to the next, for kRestTime_s on end.
constexpr double kRestSpeed_m_s = 1e-3;
constexpr double kRestTurn_rad_s = 1e-2;
constexpr double kRestTime_s = 0.05;
constexpr double kTimeSlack_s = 1e-9;  // rounding of step times
// A robot that still moves this long after its treads have stopped never rests.
constexpr double kSettleLimit_s = 3;
// Faster than any parameter could make the robot: the integration has failed.
constexpr double kDivergedSpeed_m_s = 20;
constexpr double kDivergedTurn_rad_s = 500;
const double kFallenSine = std::sin(M_PI / 4);  // of roll or pitch

// NaN and infinity fail every comparison that holds.
bool is_sane(const btRigidBody& body) {
  return body.getLinearVelocity().length2() < kDivergedSpeed_m_s * kDivergedSpeed_m_s &&
         body.getAngularVelocity().length2() < kDivergedTurn_rad_s * kDivergedTurn_rad_s;
}

bool has_fallen(const btMatrix3x3& R_SB) {
  return std::abs(R_SB[2][0]) > kFallenSine || std::abs(R_SB[2][1]) > kFallenSine || R_SB[2][2] < 0;
}

// Velocities would not do: a loaded soft contact sinks at a millimetre a second while the split
// impulse lifts it by as much, so the robot stands still with a velocity.
bool is_still(const btTransform& before, const btTransform& now, double dt_s) {
  const double shift = kRestSpeed_m_s * dt_s;
  const double turn = kRestTurn_rad_s * dt_s;
  const btMatrix3x3& R0 = before.getBasis();
  const btMatrix3x3& R1 = now.getBasis();
  return (now.getOrigin() - before.getOrigin()).length2() < shift * shift &&
         (R1.getColumn(0) - R0.getColumn(0)).length2() < turn * turn &&
         (R1.getColumn(2) - R0.getColumn(2)).length2() < turn * turn;
}

double clamped_asin(double sine) { return std::asin(std::clamp(sine, -1.0, 1.0)); }

MotionSample blend(const MotionSample& a, const MotionSample& b, double t_s) {
  const double f = b.t_s > a.t_s ? (t_s - a.t_s) / (b.t_s - a.t_s) : 1;
  const auto mix = [f](double from, double to) { return from + f * (to - from); };
  MotionSample sample;
  sample.t_s = t_s;
  sample.X_SB.x = mix(a.X_SB.x, b.X_SB.x);
  sample.X_SB.y = mix(a.X_SB.y, b.X_SB.y);
  sample.X_SB.theta = wrap_angle(a.X_SB.theta + f * wrap_angle(b.X_SB.theta - a.X_SB.theta));
  sample.height_m = mix(a.height_m, b.height_m);
  sample.roll_rad = mix(a.roll_rad, b.roll_rad);
  sample.pitch_rad = mix(a.pitch_rad, b.pitch_rad);
  sample.kinetic_energy_j = mix(a.kinetic_energy_j, b.kinetic_energy_j);
  return sample;
}

}  // namespace

class Simulator::Impl {
 public:
  Impl(const SimSettings& settings, StepCounter* steps)
      : settings_(settings), world_(settings), watched_(steps) {}

  Motion run(const DriveInput& drive, const Floor& floor, std::vector<MotionSample>* path,
             double interval_s);

  const SimSettings& settings() const { return settings_; }
  std::uint64_t steps() const { return steps_; }

 private:
  MotionSample sample(double t_s);
  Pose pose();

  SimSettings settings_;
  RobotWorld world_;
  std::uint64_t steps_ = 0;
  StepCounter* watched_;
};

Pose Simulator::Impl::pose() {
  const btTransform& X_SB = world_.robot().body().getWorldTransform();
  const btVector3 centre = X_SB * world_.robot().turning_centre();
  const btVector3 ahead = X_SB.getBasis().getColumn(0);
  return {centre.x(), centre.y(), wrap_angle(std::atan2(ahead.y(), ahead.x()))};
}

MotionSample Simulator::Impl::sample(double t_s) {
  const btTransform& X_SB = world_.robot().body().getWorldTransform();
  MotionSample result;
  result.t_s = t_s;
  result.X_SB = pose();
  result.height_m = (X_SB * world_.robot().turning_centre()).z();
  result.roll_rad = clamped_asin(X_SB.getBasis()[2][1]);
  result.pitch_rad = -clamped_asin(X_SB.getBasis()[2][0]);
  result.kinetic_energy_j = world_.robot().kinetic_energy();
  return result;
}

Motion Simulator::Impl::run(const DriveInput& drive, const Floor& floor,
                            std::vector<MotionSample>* path, double interval_s) {
  world_.reset(floor);
  const SideMotion left(drive.left, drive.duration_s);
  const SideMotion right(drive.right, drive.duration_s);
  const double still_s = std::max(left.still_time(), right.still_time());
  StepPlan plan(1 / (settings_.step_rate_hz * settings_.sub_steps), left, right, drive.duration_s);
  const btRigidBody& body = world_.robot().body();
  const btVector3 centre = world_.robot().turning_centre();

  Motion motion;
  motion.outcome = MotionOutcome::kNeverRested;
  MotionSample last;
  double next_sample_s = interval_s;
  if (path != nullptr) {
    path->clear();
    last = sample(0);
    path->push_back(last);
  }
  double max_roll_sine = 0;
  double max_pitch_sine = 0;
  double rest_s = 0;
  double t = 0;
  while (t < still_s + kSettleLimit_s) {
    const btTransform before = body.getWorldTransform();
    plan.advance();
    t = plan.start_s();
    const double dt = plan.length_s();
    world_.step({left.mean_speed(t, dt), right.mean_speed(t, dt)}, dt);
    ++steps_;
    count_step(watched_);
    const bool stopped = t >= still_s - kTimeSlack_s;
    t = plan.end_s();
    const btTransform& now = body.getWorldTransform();
    if (!is_sane(body)) {
      motion.outcome = MotionOutcome::kDiverged;
      break;
    }
    const btVector3& up = now.getBasis()[2];
    max_roll_sine = std::max(max_roll_sine, std::abs(up.y()));
    max_pitch_sine = std::max(max_pitch_sine, std::abs(up.x()));
    const double height = now.getOrigin().z() + up.dot(centre);
    motion.max_heave_m = std::max(motion.max_heave_m, std::abs(height));
    if (path != nullptr) {
      const MotionSample current = sample(t);
      for (; interval_s > 0 && next_sample_s <= t;
           next_sample_s = static_cast<double>(path->size()) * interval_s) {
        path->push_back(blend(last, current, next_sample_s));
      }
      last = current;
    }
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
  motion.max_roll_rad = clamped_asin(max_roll_sine);
  motion.max_pitch_rad = clamped_asin(max_pitch_sine);
  if (motion.outcome == MotionOutcome::kDiverged) return motion;
  motion.X_SE = pose();
  motion.rest_time_s = std::max(0.0, t - rest_s - drive.duration_s);
  if (path != nullptr && path->back().t_s < t) path->push_back(last);
  return motion;
}

Simulator::Simulator(const SimSettings& settings, StepCounter* steps)
    : impl_(std::make_unique<Impl>(settings, steps)) {}
Simulator::~Simulator() = default;
const SimSettings& Simulator::settings() const { return impl_->settings(); }
std::uint64_t Simulator::steps() const { return impl_->steps(); }

Motion Simulator::run(const DriveInput& drive, const Floor& floor, std::vector<MotionSample>* path,
                      double interval_s) {
  return impl_->run(drive, floor, path, interval_s);
}

}  // namespace gapfarm
