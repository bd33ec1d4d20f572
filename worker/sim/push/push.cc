#include "worker/sim/push/push.h"

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

class BulletPush final : public PushSimulator {
 public:
  explicit BulletPush(const PushSettings& settings) : PushSimulator(settings), world_(settings) {}

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

PathRecorder::PathRecorder(std::vector<MotionSample>* path, double interval_s)
    : path_(path), interval_s_(interval_s) {
  if (path_ != nullptr) path_->clear();
}

void PathRecorder::add(const MotionSample& sample) {
  if (path_ == nullptr) return;
  if (path_->empty()) {
    path_->push_back(sample);
    next_s_ = sample.t_s + interval_s_;
  }
  const double begin_s = path_->front().t_s;
  while (interval_s_ > 0 && next_s_ <= sample.t_s) {
    path_->push_back(blend(last_, sample, next_s_));
    next_s_ = begin_s + static_cast<double>(path_->size()) * interval_s_;
  }
  last_ = sample;
}

void PathRecorder::finish() {
  if (path_ != nullptr && !path_->empty() && path_->back().t_s < last_.t_s) path_->push_back(last_);
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

std::unique_ptr<PushSimulator> make_push_world(const PushSettings& settings) {
  return std::make_unique<BulletPush>(settings);
}

}  // namespace gapfarm
