#include "worker/sim/push/push.h"

#include <algorithm>
#include <cmath>

#include "worker/sim/observe.h"
#include "worker/sim/push/outline.h"
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
  const auto after =
      std::upper_bound(samples_.begin(), samples_.end(), t_s,
                       [](double t, const FingerSample& sample) { return t < sample.t_s; });
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

namespace {

std::unique_ptr<PushSimulator::Engine> make_engine(const PushSettings& settings) {
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

}  // namespace

PushSimulator::PushSimulator(const PushSettings& settings) : engine_(make_engine(settings)) {}
PushSimulator::~PushSimulator() = default;
const PushSettings& PushSimulator::settings() const { return engine_->settings(); }

Motion PushSimulator::run(std::span<const FingerSample> finger, const Floor& table,
                          std::vector<MotionSample>* path, double interval_s) {
  return engine_->run(finger, table, path, interval_s);
}

Motion PushSimulator::slide(const Eigen::Vector2d& velocity, double spin, const Floor& table,
                            std::vector<MotionSample>* path, double interval_s) {
  return engine_->slide(velocity, spin, table, path, interval_s);
}

}  // namespace gapfarm
