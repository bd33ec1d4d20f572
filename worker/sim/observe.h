// What is read off a body between two steps: whether it is sound, stands, rests, and where it is.
#pragma once

#include <vector>

#include "worker/sim/bullet.h"
#include "worker/sim/robot/motion.h"

namespace gapfarm {

// At rest: slower than these, as seen from one step to the next, for kRestTime_s on end.
inline constexpr double kRestSpeed_m_s = 1e-3;
inline constexpr double kRestTurn_rad_s = 1e-2;
inline constexpr double kRestTime_s = 0.05;
// What still moves this long after its drive has stopped never rests.
inline constexpr double kSettleLimit_s = 3;

// False when the integration has failed: a velocity (m/s, rad/s) is not finite or faster than any
// parameter could make it.
bool is_sane(const btVector3& velocity, const btVector3& spin);

// Whether roll or pitch is beyond 45 degrees.
bool has_fallen(const btMatrix3x3& R_SB);

// Lengths of the transforms in m.
bool is_still(const btTransform& before, const btTransform& now, double dt_s);

// Of a body's point `at` (in its frame), where its x axis points.
Pose pose_of(const btTransform& X_SB, const btVector3& at);

// Angles are kept by their sines until the end.
void keep_extremes(const btMatrix3x3& R_SB, double height_m, Extremes& extremes);
void turn_into_angles(Extremes& extremes);

// Samples at every `interval_s`, between the states that a model passes through.
class PathRecorder {
 public:
  PathRecorder(std::vector<MotionSample>* path, double interval_s);
  bool wanted() const { return path_ != nullptr; }
  void add(const MotionSample& sample);  // times must not decrease
  void finish();                         // the last state is always kept

 private:
  std::vector<MotionSample>* path_;
  double interval_s_;
  double next_s_ = 0;
  MotionSample last_;
};

}  // namespace gapfarm
