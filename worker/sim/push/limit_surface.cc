// Quasi-static pushing on an ellipsoidal limit surface, without masses and without Bullet.
//
// With the load of friction f (N) and moment m (N m) about the centre of friction on the ellipsoid
//     (f / f_max)^2 + (m / m_max)^2 = 1,        c = m_max / f_max,
// and motion normal to it, a twist is (v, w) ~ (f, m / c^2) (Howe and Cutkosky 1996; Lynch, Maekawa
// and Tanie 1992).  A force f at r from the centre therefore moves the material there by
//     M f,   M = I + [ry^2, -rx ry; -rx ry, rx^2] / c^2.
// A finger sticks when the f that gives it its own displacement lies in the friction cone; else f
// lies on the cone's edge, as great as keeps up with the finger along the normal.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "worker/sim/observe.h"
#include "worker/sim/push/push_engine.h"

namespace gapfarm {
namespace {

constexpr double kStride_m = 1e-4;  // the finger's way is cut into pieces no longer than this

class LimitSurface final : public PushSimulator {
 public:
  explicit LimitSurface(const PushSettings& settings)
      : PushSimulator(settings), centre_(settings.com_x_m, settings.com_y_m) {
    // As many equally loaded supports: m_max = f_max times their mean distance.
    double sum = 0;
    const auto supports = support_corners(settings);
    for (const Eigen::Vector2d& p : supports) sum += (p - centre_).norm();
    c2_ = std::pow(sum / static_cast<double>(supports.size()), 2);
  }

  Motion run(std::span<const FingerSample> finger, const Floor& /*table*/,
             std::vector<MotionSample>* path, double interval_s) override {
    const FingerPath finger_path(finger);
    PathRecorder recorder(path, interval_s);
    Pose X_SC;
    recorder.add(state(finger_path.begin_s(), X_SC));
    for (std::size_t i = 1; i < finger.size(); ++i) {
      const FingerSample& a = finger[i - 1];
      const FingerSample& b = finger[i];
      const double length = (b.p_SF - a.p_SF).norm();
      const int strides = std::max(1, static_cast<int>(std::ceil(length / kStride_m)));
      for (int k = 1; k <= strides; ++k) {
        const double share = static_cast<double>(k) / strides;
        const Eigen::Vector2d from = a.p_SF + (k - 1.0) / strides * (b.p_SF - a.p_SF);
        const Eigen::Vector2d to = a.p_SF + share * (b.p_SF - a.p_SF);
        push(from, to, X_SC);
        recorder.add(state(a.t_s + share * (b.t_s - a.t_s), X_SC));
      }
    }
    recorder.finish();
    Motion motion;
    motion.X_SE = X_SC;
    motion.duration_s = finger_path.end_s() - finger_path.begin_s();
    return motion;
  }

  // Without inertia nothing slides on.
  Motion slide(const Eigen::Vector2d& /*velocity*/, double /*spin*/, const Floor& /*table*/,
               std::vector<MotionSample>* path, double interval_s) override {
    PathRecorder recorder(path, interval_s);
    recorder.add(state(0, {}));
    return {};
  }

 private:
  static MotionSample state(double t_s, const Pose& X_SC) {
    MotionSample sample;
    sample.t_s = t_s;
    sample.X_SB = X_SC;
    return sample;
  }

  // The finger goes from `from` to `to`; the piece gives way.
  void push(const Eigen::Vector2d& from, const Eigen::Vector2d& to, Pose& X_SC) const {
    const Eigen::Rotation2Dd R_SC(X_SC.theta);
    const Eigen::Vector2d origin(X_SC.x, X_SC.y);
    const Touch touch = nearest_touch(settings_.corners, R_SC.inverse() * (from - origin));
    const double gap = touch.distance_m - settings_.finger_radius_m - settings_.contact_margin_m;
    const Eigen::Vector2d shift = R_SC.inverse() * (to - from);
    const Eigen::Vector2d inward = -touch.normal;
    const double advance = shift.dot(inward) - gap;
    if (advance <= 0) return;
    const Eigen::Vector2d along(-inward[1], inward[0]);
    const Eigen::Vector2d r = touch.point - centre_;
    Eigen::Matrix2d M;
    M << r[1] * r[1], -r[0] * r[1], -r[0] * r[1], r[0] * r[0];
    M = M / c2_ + Eigen::Matrix2d::Identity();
    const double share = std::min(1.0, advance / std::max(shift.dot(inward), 1e-12));
    const Eigen::Vector2d wanted = advance * inward + share * shift.dot(along) * along;
    Eigen::Vector2d f = M.inverse() * wanted;
    const double normal = f.dot(inward);
    const double lateral = f.dot(along);
    if (normal <= 0 || std::abs(lateral) > settings_.finger_friction * normal) {
      const double side = lateral > 0 ? 1 : -1;
      const Eigen::Vector2d edge = inward + side * settings_.finger_friction * along;
      f = edge * (advance / inward.dot(M * edge));
    }
    const double turn = (r[0] * f[1] - r[1] * f[0]) / c2_;
    // About the centre of friction.
    const Eigen::Vector2d middle = origin + R_SC * centre_ + R_SC * f;
    X_SC.theta = wrap_angle(X_SC.theta + turn);
    const Eigen::Vector2d moved = middle - Eigen::Rotation2Dd(X_SC.theta) * centre_;
    X_SC.x = moved[0];
    X_SC.y = moved[1];
  }

  Eigen::Vector2d centre_;
  double c2_ = 1;  // (m_max / f_max)^2, m^2
};

}  // namespace

std::unique_ptr<PushSimulator> make_limit_surface(const PushSettings& settings) {
  return std::make_unique<LimitSurface>(settings);
}

}  // namespace gapfarm
