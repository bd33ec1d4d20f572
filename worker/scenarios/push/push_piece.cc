#include "worker/scenarios/push/push_piece.h"

#include <cmath>

#include "worker/scenarios/outcome.h"
#include "worker/scenarios/put.h"

namespace gapfarm {
namespace {

double at(const ParameterValues& values, Push row) { return values[row_of(row)]; }

// The piece's own value, if it has one, else that of all.
double own_or(std::size_t index, Push first_own, Push of_all, const ParameterValues& values) {
  const double own = index < kOwnShapeFactors ? values[row_of(first_own) + index] : 0.0;
  return own > 0 ? own : at(values, of_all);
}

}  // namespace

PushNoise push_noise(const ParameterValues& values) {
  return {at(values, Push::kPushNoiseSlide),
          at(values, Push::kPushNoiseTurn),
          {at(values, Push::kPoseNoisePosition), at(values, Push::kPoseNoiseHeading)}};
}

PushSettings push_settings(const Piece& piece, std::size_t index, const ParameterValues& values,
                           const ActiveEffects& effects) {
  PushSettings s;
#define ROW(name, row)
#define SETTING(name, member, row) put(at(values, Push::name), s.member);
#include "common/parameters/push_rows.inc"
  const Eigen::Vector2d middle = centroid(piece);
  for (const Eigen::Vector2d& corner : piece.corners) s.corners.push_back(corner - middle);
  s.thickness_m = piece.thickness_m;
  s.mass_kg = piece.mass_kg * at(values, Push::kMassFactor);
  const Eigen::Vector3d moments = second_moments(piece);
  s.gyration_m2 = moments[0] + moments[1];
  s.shape_factor = own_or(index, Push::kShapeFactor1, Push::kShapeFactor, values);
  s.pressure = own_or(index, Push::kPressure1, Push::kPressure, values);
  effects.push(s);
  return s;
}

PushedPiece::PushedPiece(const Piece& piece, std::size_t index, const ParameterValues& values)
    : piece_(piece),
      effects_(push_table(), values),
      camera_scale_(at(values, gapfarm::Push::kCameraScale)),
      X_RC_{centroid(piece)[0], centroid(piece)[1], 0},
      simulator_(push_settings(piece, index, values, effects_)) {}

Pose PushedPiece::start_of(const Pose& X_WM) const {
  return effects_.place(
      effects_.recover({X_WM.x / camera_scale_, X_WM.y / camera_scale_, X_WM.theta}));
}

Pose PushedPiece::observe(const Pose& X_WR) const {
  const Pose X_WM = effects_.observe(X_WR);
  return {X_WM.x * camera_scale_, X_WM.y * camera_scale_, X_WM.theta};
}

PushedPiece::Push PushedPiece::push(const Pose& X_WR, std::span<const TipSample> tip,
                                    std::vector<PathSample>* path, double interval_s) {
  const Pose X_WS = X_WR * X_RC_;
  std::vector<FingerSample> finger;
  for (const TipSample& sample : tip) {
    const Pose p_SF = between(X_WS, {sample.x, sample.y, 0});
    finger.push_back({sample.t_s, {p_SF.x, p_SF.y}});
  }
  Floor table;
  Situation situation;
  situation.X_WR = X_WS;
  effects_.floor(situation, table);
  std::vector<MotionSample> samples;
  Push push;
  push.motion = simulator_.run(finger, table, path ? &samples : nullptr, interval_s);
  push.outcome = to_outcome(push.motion.outcome);
  push.slid_m = std::hypot(push.motion.X_SE.x, push.motion.X_SE.y);
  const Pose X_CR = inverse(X_RC_);
  push.X_WE = X_WS * push.motion.X_SE * X_CR;
  if (path) {
    path->clear();
    for (const MotionSample& s : samples) path->push_back({s.t_s, X_WS * s.X_SB * X_CR});
  }
  simulated_s_ += push.motion.duration_s;
  ++runs_;
  return push;
}

}  // namespace gapfarm
