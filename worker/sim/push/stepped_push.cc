#include "worker/sim/push/stepped_push.h"

#include <algorithm>

#include "worker/sim/observe.h"

namespace gapfarm {

Motion SteppedPush::run(std::span<const FingerSample> finger, const Floor& table,
                        std::vector<MotionSample>* path, double interval_s) {
  reset(table, Eigen::Vector2d::Zero(), 0);
  return follow(FingerPath(finger), /*at_rest=*/table.tilt_rad == 0, path, interval_s);
}

Motion SteppedPush::slide(const Eigen::Vector2d& velocity, double spin, const Floor& table,
                          std::vector<MotionSample>* path, double interval_s) {
  reset(table, velocity, spin);
  const Eigen::Vector2d away(1e3, 1e3);
  const FingerSample nowhere[] = {{0, away}, {1e-9, away}};
  return follow(FingerPath(nowhere), false, path, interval_s);
}

// The step at which a piece that rests now is next touched, less the settling; none: never.
std::optional<long> SteppedPush::next_touch(const FingerPath& finger_path, double t_s,
                                            double dt_s) const {
  const double reach = settings_.finger_radius_m + settings_.contact_margin_m + kNear_m;
  const auto when = finger_path.approach(t_s, state(t_s).X_SB, settings_.corners, reach);
  if (!when) return std::nullopt;
  return std::max(0L, static_cast<long>((*when - finger_path.begin_s()) / dt_s) - settle_steps_);
}

Motion SteppedPush::follow(const FingerPath& finger_path, bool at_rest,
                           std::vector<MotionSample>* path, double interval_s) {
  const double dt = 1 / (settings_.step_rate_hz * settings_.sub_steps);
  const double begin = finger_path.begin_s();
  PathRecorder recorder(path, interval_s);
  recorder.add(state(begin));
  Motion motion;
  motion.outcome = MotionOutcome::kNeverRested;
  double rest_s = at_rest ? kRestTime_s : 0;
  double t = begin, moved_until = begin;
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
        skip();
      }
      rest_s = 0;
    }
    t = begin + static_cast<double>(k) * dt;
    const double next = begin + static_cast<double>(k + 1) * dt;
    step(finger_path.at(t), finger_path.at(next), dt);
    ++steps;
    t = next;
    if (!sane()) {
      motion.outcome = MotionOutcome::kDiverged;
      break;
    }
    const bool stood = stands(motion);
    if (recorder.wanted()) recorder.add(state(t));
    if (!stood) {
      motion.outcome = MotionOutcome::kFellOver;
      break;
    }
    rest_s = still(dt) ? rest_s + dt : 0;
    if (rest_s == 0) moved_until = t;
  }
  motion.duration_s = static_cast<double>(steps) * dt;
  motion.max_roll_rad = clamped_asin(motion.max_roll_rad);
  motion.max_pitch_rad = clamped_asin(motion.max_pitch_rad);
  if (motion.outcome == MotionOutcome::kDiverged) return motion;
  motion.X_SE = state(t).X_SB;
  motion.rest_time_s = std::max(0.0, moved_until - finger_path.end_s());
  recorder.finish();
  return motion;
}

}  // namespace gapfarm
