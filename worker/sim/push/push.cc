#include "worker/sim/push/push.h"

#include <algorithm>
#include <cmath>

#include "worker/sim/observe.h"
#include "worker/sim/push/push_engine.h"

namespace gapfarm {
std::vector<Eigen::Vector2d> support_corners(const PushSettings& settings) {
  const double c = std::cos(settings.stretch_direction_rad);
  const double s = std::sin(settings.stretch_direction_rad);
  const Eigen::Vector2d along(c, s);
  const Eigen::Vector2d across(-s, c);
  const double longer = std::exp(settings.stretch / 2);
  std::vector<Eigen::Vector2d> supports;
  for (const Eigen::Vector2d& corner : settings.corners) {
    Eigen::Vector2d p = settings.shape_factor * corner;
    if (settings.stretch != 0) {
      p = longer * along.dot(p) * along + across.dot(p) / longer * across;
    }
    supports.emplace_back(p[0] + settings.com_x_m, p[1] + settings.com_y_m);
  }
  return supports;
}

Eigen::Vector2d FingerPath::at(double t_s) const {
  const auto after = std::ranges::upper_bound(samples_, t_s, {}, &FingerSample::t_s);
  if (after == samples_.begin()) return samples_.front().p_SF;
  if (after == samples_.end()) return samples_.back().p_SF;
  const FingerSample& a = *(after - 1);
  return a.p_SF + (t_s - a.t_s) / (after->t_s - a.t_s) * (after->p_SF - a.p_SF);
}

std::optional<double> FingerPath::approach(double t_s, const Pose& X_SC,
                                           std::span<const Eigen::Vector2d> corners,
                                           double reach_m) const {
  const double c = std::cos(X_SC.theta);
  const double s = std::sin(X_SC.theta);
  const auto clear = [&](const Eigen::Vector2d& p_SF) {
    const Eigen::Vector2d d(p_SF[0] - X_SC.x, p_SF[1] - X_SC.y);
    const Eigen::Vector2d p_CF(c * d[0] + s * d[1], c * d[1] - s * d[0]);
    return nearest_touch(corners, p_CF).distance_m - reach_m;
  };
  Eigen::Vector2d from = at(t_s);
  double from_s = t_s;
  if (clear(from) <= 0) return from_s;
  for (const FingerSample& sample : samples_) {
    if (sample.t_s <= t_s) continue;
    // A distance changes no faster than the finger moves.
    if (clear(from) <= (sample.p_SF - from).norm()) return from_s;
    from = sample.p_SF;
    from_s = sample.t_s;
  }
  return std::nullopt;
}

std::unique_ptr<PushSimulator> make_push_simulator(const PushSettings& settings) {
  switch (settings.model) {
    case PushModel::kBullet:
      return make_push_world(settings);
    case PushModel::kLimitSurface:
      return make_limit_surface(settings);
    case PushModel::kDistributed:
      return make_distributed_push(settings);
  }
  return nullptr;
}

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
  turn_into_angles(motion);
  if (motion.outcome == MotionOutcome::kDiverged) return motion;
  motion.X_SE = state(t).X_SB;
  motion.rest_time_s = std::max(0.0, moved_until - finger_path.end_s());
  recorder.finish();
  return motion;
}

}  // namespace gapfarm
