// Pushes of a piece that rests on its whole face, in the plane: see face_step.h.
//
// A step looks at finger and face where they are half a step later if the piece keeps its velocity,
// so that ways converge with the square of the step.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "worker/sim/observe.h"
#include "worker/sim/patches.h"
#include "worker/sim/push/face_step.h"
#include "worker/sim/push/push_engine.h"

namespace gapfarm {
namespace {

constexpr double kLeastGain = 0.05;     // share that a falling friction keeps
constexpr double kRepairedDepth = 0.2;  // of a depth, a step

Eigen::Matrix2d rotation(double angle_rad) {
  return Eigen::Rotation2Dd(angle_rad).toRotationMatrix();
}

class DistributedPush final : public SteppedPush {
 public:
  explicit DistributedPush(const PushSettings& settings)
      : SteppedPush(settings, 0),
        face_(face_points(settings)),
        centre_(settings.com_x_m, settings.com_y_m),
        face_step_(settings.mass_kg, settings.mass_kg * settings.gyration_m2) {}

 private:
  void reset(const Floor& table, const Eigen::Vector2d& velocity, double spin) override;
  void step(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double dt) override;
  // R_SB: how the piece is turned there.
  void place_points(const Pose& X_SM, const Eigen::Matrix2d& R_SB, double dt);
  bool place_touch(const Pose& X_SM, const Eigen::Matrix2d& R_SB, const Eigen::Vector2d& from,
                   const Eigen::Vector2d& to, double dt, FingerTouch& touch) const;

  // The centroid's pose when the centre of mass is at X_SM.
  Pose centroid_pose(const Pose& X_SM) const {
    const Eigen::Vector2d p = Eigen::Vector2d(X_SM.x, X_SM.y) - rotation(X_SM.theta) * centre_;
    return {p[0], p[1], X_SM.theta};
  }
  MotionSample state(double t_s) const override;
  bool sane() const override {
    return is_sane({velocity_[0], velocity_[1], 0}, {0, 0, velocity_[2]});
  }
  bool still(double /*dt_s*/) const override {
    return std::hypot(velocity_[0], velocity_[1]) < kRestSpeed_m_s &&
           std::abs(velocity_[2]) < kRestTurn_rad_s;
  }

  std::vector<FacePoint> face_;
  Eigen::Vector2d centre_;  // of mass, from the centroid
  FaceStep face_step_;
  FaceStep::Points points_;  // in the grain's axes
  Floor table_;
  Eigen::Matrix2d R_GS_ = Eigen::Matrix2d::Identity();  // to the grain's axes
  double load_n_ = 0;                                   // on the whole face
  Eigen::Vector2d pull_ = Eigen::Vector2d::Zero();      // of gravity down a slope, m/s^2
  Pose X_SM_;                                           // centre of mass
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
};

void DistributedPush::reset(const Floor& table, const Eigen::Vector2d& velocity, double spin) {
  table_ = table;
  const Eigen::Vector3d gravity = gravity_in_start_frame(table, settings_.gravity_m_s2);
  load_n_ = -gravity[2] * settings_.mass_kg;
  R_GS_ = rotation(-table.grain_direction_rad);
  pull_ = gravity.head<2>();
  X_SM_ = {centre_[0], centre_[1], 0};
  const Eigen::Vector2d at_centre = velocity + spin * Eigen::Vector2d(-centre_[1], centre_[0]);
  velocity_ = {at_centre[0], at_centre[1], spin};
  face_step_.reset();
  for (auto* of_points : {&points_.x, &points_.y, &points_.extent, &points_.impulse}) {
    of_points->assign((face_.size() + FaceStep::kBlock - 1) / FaceStep::kBlock * FaceStep::kBlock,
                      0);
  }
  for (std::size_t i = 0; i < face_.size(); ++i) points_.extent[i] = face_[i].extent_m;
  // Friction is mu / sqrt(ratio) along the grain and mu sqrt(ratio) across it.
  points_.q_x = 1 / table.grain_ratio;
  points_.q_y = table.grain_ratio;
}

void DistributedPush::place_points(const Pose& X_SM, const Eigen::Matrix2d& R_SB, double dt) {
  const Eigen::Matrix2d R_GB = R_GS_ * R_SB;
  const double whole = settings_.ground_friction * load_n_ * dt;
  const bool varies = table_.speed_slope_s_m != 0 ||
                      std::any_of(table_.patches.begin(), table_.patches.end(),
                                  [](const FrictionDisc& disc) { return disc.ratio != 1; });
  for (std::size_t i = 0; i < face_.size(); ++i) {
    const Eigen::Vector2d r = face_[i].p - centre_;
    const Eigen::Vector2d in_grain = R_GB * r;
    points_.x[i] = in_grain[0];
    points_.y[i] = in_grain[1];
    points_.impulse[i] = whole * face_[i].share;
    if (!varies) continue;
    const Eigen::Vector2d arm = R_SB * r;
    double gain = 1;
    if (table_.speed_slope_s_m != 0) {
      const double speed =
          std::hypot(velocity_[0] - velocity_[2] * arm[1], velocity_[1] + velocity_[2] * arm[0]);
      gain = std::max(kLeastGain, 1 + table_.speed_slope_s_m * speed);
    }
    points_.impulse[i] *= gain * patch_factor(table_, X_SM.x + arm[0], X_SM.y + arm[1]);
  }
}

// False: too far to matter in this step.
bool DistributedPush::place_touch(const Pose& X_SM, const Eigen::Matrix2d& R_SB,
                                  const Eigen::Vector2d& from, const Eigen::Vector2d& to, double dt,
                                  FingerTouch& touch) const {
  const Eigen::Vector2d finger = (from + to) / 2;
  const Eigen::Vector2d seen =
      R_SB.transpose() * (finger - Eigen::Vector2d(X_SM.x, X_SM.y)) + centre_;
  const Touch nearest = nearest_touch(settings_.corners, seen);
  const double gap = nearest.distance_m - settings_.finger_radius_m - settings_.contact_margin_m;
  const double moved = (std::hypot(velocity_[0], velocity_[1]) * dt + (to - from).norm());
  if (gap > kNear_m + moved) return false;
  const Eigen::Vector2d inward = R_SB * -nearest.normal;
  const Eigen::Vector2d arm = R_SB * (nearest.point - centre_);
  touch.velocity = (to - from) / dt;
  const Eigen::Vector2d material =
      velocity_.head<2>() + velocity_[2] * Eigen::Vector2d(-arm[1], arm[0]);
  // From the middle of the step back to its begin, as far as the piece's own motion goes, and on to
  // the end with the finger's.
  touch.gap_m = gap - dt / 2 * inward.dot(material + touch.velocity);
  const bool rigid = settings_.finger_compliance_m_n <= 0;
  if (rigid) {
    const double before = gap - dt / 2 * inward.dot(material - touch.velocity);
    if (before < 0) touch.gap_m -= (1 - kRepairedDepth) * before;
  }
  touch.compliance_m_n = settings_.finger_compliance_m_n;
  touch.friction = settings_.finger_friction;
  touch.inward = R_GS_ * inward;
  touch.arm = R_GS_ * arm;
  touch.velocity = R_GS_ * touch.velocity;
  return true;
}

void DistributedPush::step(const Eigen::Vector2d& from, const Eigen::Vector2d& to, double dt) {
  const Pose middle{X_SM_.x + dt / 2 * velocity_[0], X_SM_.y + dt / 2 * velocity_[1],
                    X_SM_.theta + dt / 2 * velocity_[2]};
  const Eigen::Matrix2d R_SB = rotation(middle.theta);
  place_points(middle, R_SB, dt);
  FingerTouch touch;
  const bool near = place_touch(middle, R_SB, from, to, dt, touch);
  const Eigen::Vector2d now = R_GS_ * velocity_.head<2>();
  const Eigen::Vector2d free = now + dt * (R_GS_ * pull_);
  const Eigen::Vector3d after =
      face_step_.solve(points_, {free[0], free[1], velocity_[2]}, {now[0], now[1], velocity_[2]},
                       near ? &touch : nullptr, dt);
  velocity_ << R_GS_.transpose() * after.head<2>(), after[2];
  X_SM_.x += dt * velocity_[0];
  X_SM_.y += dt * velocity_[1];
  X_SM_.theta += dt * velocity_[2];
}

MotionSample DistributedPush::state(double t_s) const {
  MotionSample sample;
  sample.t_s = t_s;
  sample.X_SB = centroid_pose(X_SM_);
  sample.X_SB.theta = wrap_angle(sample.X_SB.theta);
  sample.kinetic_energy_j =
      settings_.mass_kg / 2 *
      (velocity_.head<2>().squaredNorm() + settings_.gyration_m2 * velocity_[2] * velocity_[2]);
  return sample;
}

}  // namespace

std::unique_ptr<PushSimulator> make_distributed_push(const PushSettings& settings) {
  return std::make_unique<DistributedPush>(settings);
}

}  // namespace gapfarm
