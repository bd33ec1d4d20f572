#include "worker/scenarios/push/pushed_piece.h"

#include <cmath>

#include "common/parameters/table.h"
#include "worker/scenarios/scenario.h"

namespace gapfarm {
namespace {

double at(const ParameterValues& values, Push row) { return values[row_of(row)]; }

// The piece's own value, if it has one, else that of all.
double own_or(std::size_t index, Push first_own, Push of_all, const ParameterValues& values) {
  const double own = index < kOwnShapeFactors ? values[row_of(first_own) + index] : 0.0;
  return own > 0 ? own : at(values, of_all);
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

}  // namespace

std::size_t PushKey::hash() const {
  const PushSettings& s = settings;
  return hash_of(table, hash_of({static_cast<double>(trial), X_WS.x, X_WS.y, X_WS.theta,
                                 s.shape_factor, s.pressure, s.stretch, s.stretch_direction_rad,
                                 s.com_x_m, s.com_y_m, s.ground_friction, s.finger_friction,
                                 s.finger_compliance_m_n, s.contact_margin_m, s.step_rate_hz}));
}

PushNoise push_noise(const ParameterValues& values) {
  return {at(values, Push::kPushNoiseSlide),
          at(values, Push::kPushNoiseTurn),
          {at(values, Push::kPoseNoisePosition), at(values, Push::kPoseNoiseHeading)}};
}

PushedPiece::PushedPiece(const Piece& piece, std::size_t index, const ParameterValues& values)
    : piece_(piece),
      effects_(push_table(), values),
      camera_scale_(at(values, gapfarm::Push::kCameraScale)),
      X_RC_{centroid(piece)[0], centroid(piece)[1], 0},
      simulator_(make_push_simulator(push_settings(piece, index, values, effects_))) {}

Pose PushedPiece::start_of(const Pose& X_WM) const {
  return effects_.place(
      effects_.recover({X_WM.x / camera_scale_, X_WM.y / camera_scale_, X_WM.theta}));
}

Pose PushedPiece::observe(const Pose& X_WR) const {
  const Pose X_WM = effects_.observe(X_WR);
  return {X_WM.x * camera_scale_, X_WM.y * camera_scale_, X_WM.theta};
}

Floor PushedPiece::table_at(const Pose& X_WS) const {
  Floor table;
  Situation situation;
  situation.X_WR = X_WS;
  effects_.floor(situation, table);
  return table;
}

Motion PushedPiece::simulate(const Pose& X_WS, std::span<const TipSample> tip, const Floor& table,
                             std::vector<MotionSample>* samples, double interval_s) {
  std::vector<FingerSample> finger;
  for (const TipSample& sample : tip) {
    const Pose p_SF = between(X_WS, {sample.x, sample.y, 0});
    finger.push_back({sample.t_s, {p_SF.x, p_SF.y}});
  }
  return simulator_->run(finger, table, samples, interval_s);
}

PushedPiece::Push PushedPiece::pushed(const Pose& X_WS, const Motion& motion) {
  ++runs_;
  return {to_outcome(motion.outcome), X_WS * motion.X_SE * inverse(X_RC_),
          std::hypot(motion.X_SE.x, motion.X_SE.y), motion};
}

PushedPiece::Push PushedPiece::push(const Pose& X_WR, std::span<const TipSample> tip,
                                    std::vector<PathSample>* path, double interval_s) {
  const Pose X_WS = X_WR * X_RC_;
  std::vector<MotionSample> samples;
  const Motion motion = simulate(X_WS, tip, table_at(X_WS), path ? &samples : nullptr, interval_s);
  if (path) {
    path->clear();
    for (const MotionSample& s : samples) {
      path->push_back({s.t_s, X_WS * s.X_SB * inverse(X_RC_)});
    }
  }
  return pushed(X_WS, motion);
}

PushedPiece::Push PushedPiece::push(const Pose& X_WR, std::uint32_t trial,
                                    std::span<const TipSample> tip, MotionMemo<PushKey>* memo) {
  if (memo == nullptr) return push(X_WR, tip);
  const Pose X_WS = X_WR * X_RC_;
  const PushKey key{trial, simulator_->settings(), X_WS, table_at(X_WS)};
  if (const auto known = memo->find(key)) return pushed(X_WS, *known);
  const Motion motion = simulate(X_WS, tip, key.table);
  memo->keep(key, motion);
  return pushed(X_WS, motion);
}

}  // namespace gapfarm
