// The models of pushing, and what they share.  Internal to worker/sim.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>

#include "worker/sim/push/push.h"

namespace gapfarm {

std::unique_ptr<PushSimulator> make_push_world(const PushSettings& settings);
std::unique_ptr<PushSimulator> make_limit_surface(const PushSettings& settings);
std::unique_ptr<PushSimulator> make_distributed_push(const PushSettings& settings);

// The finger's way: straight between samples, standing still before and after.
class FingerPath {
 public:
  // REQUIRES: samples at increasing times that outlive this.
  explicit FingerPath(std::span<const FingerSample> samples) : samples_(samples) {}
  Eigen::Vector2d at(double t_s) const;
  double begin_s() const { return samples_.front().t_s; }
  double end_s() const { return samples_.back().t_s; }
  // Time from `t_s` on at which a finger of this reach first touches the outline at X_SC, to within
  // the way's own samples and never late; none when it does not.
  std::optional<double> approach(double t_s, const Pose& X_SC,
                                 std::span<const Eigen::Vector2d> corners, double reach_m) const;

 private:
  std::span<const FingerSample> samples_;
};

// A convex outline and a point beside it.

// Where a point is nearest to an outline.
struct Touch {
  double distance_m = 0;                             // negative inside
  Eigen::Vector2d point = Eigen::Vector2d::Zero();   // on the outline
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();  // unit, out of the outline
};

// REQUIRES: convex corners, counter-clockwise.
Touch nearest_touch(std::span<const Eigen::Vector2d> corners, const Eigen::Vector2d& p);

}  // namespace gapfarm
