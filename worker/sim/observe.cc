#include "worker/sim/observe.h"

#include <algorithm>
#include <cmath>

namespace gapfarm {
namespace {

constexpr double kDivergedSpeed_m_s = 20;
constexpr double kDivergedTurn_rad_s = 500;
const double kFallenSine = std::sin(M_PI / 4);  // of roll or pitch

}  // namespace

// NaN and infinity fail every comparison that holds.
bool is_sane(const btVector3& velocity, const btVector3& spin) {
  return velocity.length2() < kDivergedSpeed_m_s * kDivergedSpeed_m_s &&
         spin.length2() < kDivergedTurn_rad_s * kDivergedTurn_rad_s;
}

bool has_fallen(const btMatrix3x3& R_SB) {
  return std::abs(R_SB[2][0]) > kFallenSine || std::abs(R_SB[2][1]) > kFallenSine || R_SB[2][2] < 0;
}

// Velocities would not do: a loaded soft contact sinks at a millimetre a second while the split
// impulse lifts it by as much, so the robot stands still with a velocity.
bool is_still(const btTransform& before, const btTransform& now, double dt_s) {
  const double shift = kRestSpeed_m_s * dt_s;
  const double turn = kRestTurn_rad_s * dt_s;
  const btMatrix3x3& R0 = before.getBasis();
  const btMatrix3x3& R1 = now.getBasis();
  return (now.getOrigin() - before.getOrigin()).length2() < shift * shift &&
         (R1.getColumn(0) - R0.getColumn(0)).length2() < turn * turn &&
         (R1.getColumn(2) - R0.getColumn(2)).length2() < turn * turn;
}

Pose pose_of(const btTransform& X_SB, const btVector3& at) {
  const btVector3 p = X_SB * at;
  const btVector3 ahead = X_SB.getBasis().getColumn(0);
  return {p.x(), p.y(), wrap_angle(std::atan2(ahead.y(), ahead.x()))};
}

void keep_extremes(const btMatrix3x3& R_SB, double height_m, Extremes& extremes) {
  extremes.max_roll_rad = std::max(extremes.max_roll_rad, std::abs(R_SB[2].y()));
  extremes.max_pitch_rad = std::max(extremes.max_pitch_rad, std::abs(R_SB[2].x()));
  extremes.max_heave_m = std::max(extremes.max_heave_m, std::abs(height_m));
}

void turn_into_angles(Extremes& extremes) {
  for (double* angle : {&extremes.max_roll_rad, &extremes.max_pitch_rad}) {
    *angle = std::asin(std::min(*angle, 1.0));
  }
}

namespace {

// The sample between two others at `t_s`.
MotionSample blend(const MotionSample& a, const MotionSample& b, double t_s) {
  const double f = b.t_s > a.t_s ? (t_s - a.t_s) / (b.t_s - a.t_s) : 1;
  const auto mix = [f](double from, double to) { return from + f * (to - from); };
  MotionSample sample;
  sample.t_s = t_s;
  sample.X_SB.x = mix(a.X_SB.x, b.X_SB.x);
  sample.X_SB.y = mix(a.X_SB.y, b.X_SB.y);
  sample.X_SB.theta = wrap_angle(a.X_SB.theta + f * wrap_angle(b.X_SB.theta - a.X_SB.theta));
  sample.height_m = mix(a.height_m, b.height_m);
  sample.kinetic_energy_j = mix(a.kinetic_energy_j, b.kinetic_energy_j);
  return sample;
}

}  // namespace

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

}  // namespace gapfarm
