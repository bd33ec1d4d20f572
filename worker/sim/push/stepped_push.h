// Pushes in steps of one length: a model says how a step moves the piece, and this when steps are
// worth taking.  Internal to worker/sim.
#pragma once

#include <optional>

#include "worker/sim/push/push_engine.h"

namespace gapfarm {

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
