// Where a pose may have been logged, and where a logged one may have been, near lines across which
// the camera's view jumps.
//
// Two cameras that meet at a line report a place differently, and a robot whose place is known to a
// centimetre may have been seen by either.  The means of a prediction take the one that the logged
// end speaks for; its distribution holds both.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "worker/effects/behaviour.h"

namespace gapfarm {

struct View {
  double weight = 1;
  Pose pose;
};

class Views {
 public:
  // `effects` outlive it.
  explicit Views(const ActiveEffects& effects);

  // Logged poses of a robot at X_WR, whose place has these standard deviations along the world's
  // axes; weights sum to 1.
  std::vector<View> observed(const Pose& X_WR, const Eigen::Vector2d& sd_m) const;
  // Poses of a robot that was logged at X_WM by a reading with this standard deviation.
  std::vector<View> recovered(const Pose& X_WM, double sd_m) const;
  // Where the end of a motion X_SE is logged that was logged to begin at X_WS.  Of the views that
  // may have reported the start and the end, those by which it comes nearest to the logged end: a
  // reading shows its camera better than a prediction does, which near a line may miss by more.
  Pose logged_end(const Pose& X_WS, const Pose& X_SE, const Pose& logged, double sd_m) const;

 private:
  // How likely a robot there is on these sides of all lines.
  double likelihood(unsigned sides, const Pose& X_WR, const Eigen::Vector2d& sd_m) const;

  const ActiveEffects& effects_;
  std::vector<ActiveEffects> from_;  // by sides; empty: there is no line
};

}  // namespace gapfarm
