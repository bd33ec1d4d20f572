#include "worker/scenarios/srv1/srv1_robot.h"

#include <algorithm>
#include <cmath>

#include "worker/scenarios/external.h"
#include "worker/scenarios/put.h"

namespace gapfarm {
namespace {

double at(const ParameterValues& values, Srv1 row) { return values[row_of(row)]; }

SideDrive side_drive(const SideState& side, double full_speed_m_s, double noise_gain) {
  return {side.duty * full_speed_m_s * side.gain * noise_gain, side.lag_s, side.dead_travel_m};
}

NoiseSettings noise_of(const Problem& problem, const ParameterValues& values) {
  if (problem.external) {
    const ExternalTable& e = problem.external->table;
    return {values[e.drive_noise_common()],
            values[e.drive_noise_side()],
            {values[e.pose_noise_position()], values[e.pose_noise_heading()]},
            {values[e.drive_noise_tail()], values[e.pose_noise_tail()]}};
  }
  return {at(values, Srv1::kDriveNoiseCommon),
          at(values, Srv1::kDriveNoiseSide),
          {at(values, Srv1::kPoseNoisePosition), at(values, Srv1::kPoseNoiseHeading)},
          {at(values, Srv1::kDriveNoiseTail), at(values, Srv1::kPoseNoiseTail)}};
}

class BulletVehicle final : public Vehicle {
 public:
  BulletVehicle(const SimSettings& settings, StepCounter* steps, MotionMemo* memo)
      : simulator_(settings, steps), memo_(memo) {}
  Motion run(const DriveInput& drive, const Floor& floor, std::vector<MotionSample>* path,
             double interval_s) override {
    if (memo_ == nullptr || path != nullptr) return simulator_.run(drive, floor, path, interval_s);
    const MotionKey key{simulator_.settings(), drive, floor};
    if (const auto known = memo_->find(key)) return *known;
    const Motion motion = simulator_.run(drive, floor);
    memo_->keep(key, motion);
    return motion;
  }

 private:
  Simulator simulator_;
  MotionMemo* memo_;
};

}  // namespace

SimSettings sim_settings(const RobotSize& size, const ParameterValues& values,
                         const ActiveEffects& effects) {
  SimSettings s;
  s.size = size;
#define ROW(name, row)
#define SETTING(name, member, row) put(at(values, Srv1::name), s.member);
#include "common/parameters/srv1_rows.inc"
  if (s.robot != RobotModel::kTreads) s.tread_creep = 0;
  effects.settings(s);
  return s;
}

std::vector<Gains> cubature_points(const NoiseSettings& noise) {
  // Gains (l, r) have variance c^2 + s^2 and covariance c^2; along (1, 1)/sqrt(2) that is
  // s^2 + 2 c^2, along (1, -1)/sqrt(2) it is s^2.  The factors sqrt(2) and 1/sqrt(2) cancel.
  const double together = std::hypot(noise.drive_side, std::sqrt(2.0) * noise.drive_common);
  const double apart = noise.drive_side;
  if (together == 0) return {};
  return {{1 + together, 1 + together},
          {1 - together, 1 - together},
          {1 + apart, 1 - apart},
          {1 - apart, 1 + apart}};
}

Gains draw_gains(const NoiseSettings& noise, Stream& stream) {
  const double common = noise.drive_common * stream.normal();
  const double left = noise.drive_side * stream.normal();
  const double right = noise.drive_side * stream.normal();
  if (noise.tails.drive == 0) return {1 + common + left, 1 + common + right};
  const double core = std::sqrt(draw_tail_scale(noise.tails.drive, stream));
  return {std::clamp(1 + core * (common + left), 0.0, 2.0),
          std::clamp(1 + core * (common + right), 0.0, 2.0)};
}

std::unique_ptr<Vehicle> make_vehicle(const Problem& problem, const ParameterValues& values,
                                      const ActiveEffects& effects, StepCounter* steps,
                                      MotionMemo* memo) {
  if (problem.external) return make_external_vehicle(problem, values, steps);
  return std::make_unique<BulletVehicle>(sim_settings(problem.treads().size(), values, effects),
                                         steps, memo);
}

Srv1Robot::Srv1Robot(const ParameterValues& values, StepCounter* steps)
    : Srv1Robot(Problem{}, values, steps, nullptr) {}

Srv1Robot::Srv1Robot(const Problem& problem, const ParameterValues& values, StepCounter* steps,
                     MotionMemo* memo)
    : effects_(problem.table(), values),
      noise_(noise_of(problem, values)),
      full_speed_m_s_(problem.external ? 1 : at(values, Srv1::kFullSpeed)),
      vehicle_(make_vehicle(problem, values, effects_, steps, memo)) {}

NoiseSettings Srv1Robot::foreseen_noise() const {
  NoiseSettings noise = noise_;
  const double spread = effects_.session_spread();
  if (spread > 0) noise.drive_common = std::hypot(noise.drive_common, spread);
  return noise;
}

double Srv1Robot::draw_session_gain(Stream& stream) const {
  const double spread = effects_.session_spread();
  return spread > 0 ? std::clamp(1 + spread * stream.normal(), 0.0, 2.0) : 1;
}

Motion Srv1Robot::run(const DrivenCommand& drive, const Situation& situation, const Gains& gains,
                      std::vector<MotionSample>* path, double interval_s) {
  DriveState state;
  state.left.duty = drive.left;
  state.right.duty = drive.right;
  state.duration_s = drive.duration_s;
  effects_.drive(situation, state);
  Floor floor;
  effects_.floor(situation, floor);
  const DriveInput input{side_drive(state.left, full_speed_m_s_, gains.left),
                         side_drive(state.right, full_speed_m_s_, gains.right), state.duration_s};
  const Motion motion = vehicle_->run(input, floor, path, interval_s);
  simulated_s_ += motion.duration_s;
  ++runs_;
  return motion;
}

Pose pose_before_end(const std::vector<MotionSample>& path, double age_s) {
  const double when = path.back().t_s - age_s;
  const auto after = std::upper_bound(path.begin(), path.end(), when,
                                      [](double t, const MotionSample& s) { return t < s.t_s; });
  if (after == path.begin()) return path.front().X_SB;
  if (after == path.end()) return path.back().X_SB;
  const MotionSample& a = *(after - 1);
  const double share = (when - a.t_s) / (after->t_s - a.t_s);
  return a.X_SB * exp(share * log(between(a.X_SB, after->X_SB)));
}

}  // namespace gapfarm
