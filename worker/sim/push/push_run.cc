// Pushes in Bullet from rest to rest.
#include <algorithm>
#include <cmath>

#include "worker/sim/observe.h"
#include "worker/sim/push/push_engine.h"
#include "worker/sim/push/push_world.h"

namespace gapfarm {
namespace {

// The finger's touch is simulated from this far away, and from so many steps before, in which the
// supports take up the load.
constexpr double kApproach_m = 2e-3;
constexpr int kSettleSteps = 8;

class BulletPush final : public PushSimulator::Engine {
 public:
  explicit BulletPush(const PushSettings& settings) : Engine(settings), world_(settings) {}

  Motion run(std::span<const FingerSample> finger, const Floor& table,
             std::vector<MotionSample>* path, double interval_s) override {
    world_.reset(table, Eigen::Vector2d::Zero(), 0);
    return follow(FingerPath(finger), /*at_rest=*/table.tilt_rad == 0, path, interval_s);
  }

  Motion slide(const Eigen::Vector2d& velocity, double spin, const Floor& table,
               std::vector<MotionSample>* path, double interval_s) override {
    world_.reset(table, velocity, spin);
    const Eigen::Vector2d away(1e3, 1e3);
    const FingerSample nowhere[] = {{0, away}, {1e-9, away}};
    return follow(FingerPath(nowhere), false, path, interval_s);
  }

 private:
  Motion follow(const FingerPath& finger_path, bool at_rest, std::vector<MotionSample>* path,
                double interval_s);

  // The step at which a piece that rests now is next touched, less the settling; none: never.
  std::optional<long> next_touch(const FingerPath& finger_path, double t_s, double dt_s) const {
    const double reach = settings_.finger_radius_m + settings_.contact_margin_m + kApproach_m;
    const auto when = finger_path.approach(t_s, world_.state(t_s).X_SB, settings_.corners, reach);
    if (!when) return std::nullopt;
    return std::max(0L, static_cast<long>((*when - finger_path.begin_s()) / dt_s) - kSettleSteps);
  }

  PushWorld world_;
};

Motion BulletPush::follow(const FingerPath& finger_path, bool at_rest,
                          std::vector<MotionSample>* path, double interval_s) {
  const double dt = 1 / (settings_.step_rate_hz * settings_.sub_steps);
  const double begin = finger_path.begin_s();
  PathRecorder recorder(path, interval_s);
  Motion motion;
  motion.outcome = MotionOutcome::kNeverRested;
  recorder.add(world_.state(begin));
  double max_roll_sine = 0, max_pitch_sine = 0;
  double rest_s = at_rest ? kRestTime_s : 0;
  double t = begin;
  double moved_until = begin;
  long steps = 0;
  for (long k = 0; t < finger_path.end_s() + kSettleLimit_s; ++k) {
    if (rest_s >= kRestTime_s) {
      const auto touch = t < finger_path.end_s() ? next_touch(finger_path, t, dt) : std::nullopt;
      if (!touch) {
        motion.outcome = MotionOutcome::kOk;
        break;
      }
      if (*touch > k) {  // nothing happens until then
        k = *touch;
        world_.forget_touch();
      }
      rest_s = 0;
    }
    t = begin + static_cast<double>(k) * dt;
    const double next = begin + static_cast<double>(k + 1) * dt;
    const btTransform before = world_.metric_transform();
    world_.step(finger_path.at(t), finger_path.at(next), dt);
    ++steps;
    t = next;
    if (!is_sane(world_.metric_velocity(), world_.body().getAngularVelocity())) {
      motion.outcome = MotionOutcome::kDiverged;
      break;
    }
    const btTransform now = world_.metric_transform();
    const btVector3& up = now.getBasis()[2];
    max_roll_sine = std::max(max_roll_sine, std::abs(up.y()));
    max_pitch_sine = std::max(max_pitch_sine, std::abs(up.x()));
    motion.max_heave_m = std::max(motion.max_heave_m, std::abs(world_.state(t).height_m));
    if (recorder.wanted()) recorder.add(world_.state(t));
    if (has_fallen(now.getBasis())) {
      motion.outcome = MotionOutcome::kFellOver;
      break;
    }
    const bool still = is_still(before, now, dt);
    rest_s = still ? rest_s + dt : 0;
    if (!still) moved_until = t;
  }
  motion.duration_s = static_cast<double>(steps) * dt;
  motion.max_roll_rad = clamped_asin(max_roll_sine);
  motion.max_pitch_rad = clamped_asin(max_pitch_sine);
  if (motion.outcome == MotionOutcome::kDiverged) return motion;
  motion.X_SE = world_.state(t).X_SB;
  motion.rest_time_s = std::max(0.0, moved_until - finger_path.end_s());
  recorder.finish();
  return motion;
}

}  // namespace

std::unique_ptr<PushSimulator::Engine> make_push_world(const PushSettings& settings) {
  return std::make_unique<BulletPush>(settings);
}

}  // namespace gapfarm
