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

// Pushes in steps of one length: a model says how a step moves the piece, and this when steps are
// worth taking.
class SteppedPush : public PushSimulator {
 public:
  Motion run(std::span<const FingerSample> finger, const Floor& table,
             std::vector<MotionSample>* path, double interval_s) final;
  Motion slide(const Eigen::Vector2d& velocity, double spin, const Floor& table,
               std::vector<MotionSample>* path, double interval_s) final;

 protected:
  // The finger is looked at from so near.
  static constexpr double kNear_m = 2e-3;

  // `settle_steps` are simulated before the finger may touch a piece that rests.
  SteppedPush(const PushSettings& settings, long settle_steps)
      : PushSimulator(settings), settle_steps_(settle_steps) {}

 private:
  // Puts the piece at the start with its centroid at this speed.
  virtual void reset(const Floor& table, const Eigen::Vector2d& velocity, double spin) = 0;
  virtual void step(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double dt_s) = 0;
  // The step after this one does not follow from it: the finger jumps.
  virtual void skip() {}
  virtual MotionSample state(double t_s) const = 0;
  // Of the last step: whether what came out is sound, and whether the piece stood still.
  virtual bool sane() const = 0;
  virtual bool still(double dt_s) const = 0;
  // Keeps in `motion` how far the piece has left the table's plane, angles by their sines.  False:
  // it has fallen over.
  virtual bool stands(Motion& /*motion*/) const { return true; }

  Motion follow(const FingerPath& finger_path, bool at_rest, std::vector<MotionSample>* path,
                double interval_s);
  std::optional<long> next_touch(const FingerPath& finger_path, double t_s, double dt_s) const;

  long settle_steps_;
};

}  // namespace gapfarm
