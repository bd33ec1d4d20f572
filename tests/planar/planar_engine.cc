#include "tests/planar/planar_engine.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace gapfarm::truths {
namespace {

constexpr double kGravity_m_s2 = 9.81;
constexpr double kStep_s = 5e-4;
constexpr int kStepsASample = 20;
constexpr std::size_t kStrips = 8;       // under each tread
constexpr double kShearRate_m_s = 5e-3;  // a standing tread's soil is new again after length / this
constexpr double kDragRate_m_s = 1e-3;   // below which drag fades
constexpr double kLoadLag_s = 0.01;      // of the load behind the accelerations
constexpr double kRest_m_s = 1e-3, kRest_rad_s = 1e-2;
constexpr double kLongestRest_s = 2;
constexpr double kBodyLength = 1.6, kBodyWidth = 1.3;  // of treads and gauge: for the inertia

using Loads = std::array<std::array<double, kStrips>, 2>;  // N, left and right

class PlanarEngine : public Engine {
 public:
  explicit PlanarEngine(const Scene& scene) : scene_(scene) {
    const Robot& r = scene.robot;
    const double length = kBodyLength * r.length_m, width = kBodyWidth * r.gauge_m;
    inertia_ = r.mass_kg * (length * length + width * width) / 12;
  }

  Path drive(const Pose& X_WS, const Drive& drive) override {
    Motor left(drive.left, drive), right(drive.right, drive);
    X_WR_ = X_WS;
    velocity_.setZero();
    pull_.setZero();
    Path path = {{0, X_WS}};
    int step = 0;
    const double last_s = drive.on_s + 8 * drive.lag_s + kLongestRest_s;
    while (step * kStep_s < last_s) {
      advance({left.step(kStep_s), right.step(kStep_s)}, {left.commanded(), right.commanded()});
      ++step;
      if (step % kStepsASample == 0) path.push_back({step * kStep_s, X_WR_});
      if (left.stands() && right.stands() && rests()) break;
    }
    if (path.back().t_s < step * kStep_s) path.push_back({step * kStep_s, X_WR_});
    return path;
  }

 private:
  bool rests() const {
    return velocity_.head<2>().norm() < kRest_m_s && std::abs(velocity_[2]) < kRest_rad_s;
  }

  // Where a strip lies in the robot's frame, m.
  double ahead(std::size_t i) const {
    return scene_.robot.length_m * ((static_cast<double>(i) + 0.5) / kStrips - 0.5);
  }
  double aside(std::size_t side) const { return (side == 0 ? 0.5 : -0.5) * scene_.robot.gauge_m; }

  // Gravity along the floor in the robot's frame, m/s^2.
  Eigen::Vector2d downhill() const {
    const double along = kGravity_m_s2 * std::sin(scene_.floor.tilt_rad);
    const double angle = scene_.floor.tilt_direction_rad - X_WR_.theta;
    return along * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }

  // The strips carry the weight about the point below which it acts, linearly along a tread.
  Loads loads() const {
    const Robot& r = scene_.robot;
    const double lever = r.mass_height_m / kGravity_m_s2;
    const Eigen::Vector2d g = downhill();
    const double cx = scene_.com_x_m + lever * (g.x() - pull_.x());
    const double cy = scene_.com_y_m + lever * (g.y() - pull_.y());
    const double to_left = std::clamp(0.5 + cy / r.gauge_m, 0.0, 1.0);
    std::array<double, kStrips> shape;
    double sum = 0;
    for (std::size_t i = 0; i < kStrips; ++i) {
      shape[i] = std::max(0.0, 1 + 12 * cx * ahead(i) / (r.length_m * r.length_m));
      sum += shape[i];
    }
    Loads all;
    for (std::size_t i = 0; i < kStrips; ++i) {
      all[0][i] = weight() * to_left * shape[i] / sum;
      all[1][i] = weight() * (1 - to_left) * shape[i] / sum;
    }
    return all;
  }

  double friction_at(double x, double y) const {
    const Floor& f = scene_.floor;
    if (f.patch_ratio == 1) return scene_.robot.friction;
    const Pose X_WE = X_WR_ * Pose{x, y, 0};
    const bool inside = std::hypot(X_WE.x - f.patch_x_m, X_WE.y - f.patch_y_m) < f.patch_radius_m;
    return scene_.robot.friction * (inside ? f.patch_ratio : 1);
  }

  double weight() const {
    return scene_.robot.mass_kg * kGravity_m_s2 * std::cos(scene_.floor.tilt_rad);
  }

  // Force over velocity of what drags a tread that carries `load` and rolls at `u`, N s/m.
  double rolling_drag(double load, double u) const {
    return scene_.floor.rolling_resistance * load / std::hypot(u, kDragRate_m_s);
  }

  // The same of the nap, which drags the robot by where it travels, however it turns.
  double nap_drag() const {
    const Floor& f = scene_.floor;
    const double angle = f.nap_direction_rad - X_WR_.theta;
    const double speed = std::hypot(velocity_[0], velocity_[1], kDragRate_m_s);
    const double along = velocity_[0] * std::cos(angle) + velocity_[1] * std::sin(angle);
    return f.nap_strength * weight() * (1 - along / speed) / 2 / speed;
  }

  // Force over slip of a strip, along and across; `told` says which of its ends is the front.
  Eigen::Vector2d grip(double x, double y, double load, double slip_x, double slip_y, double tread,
                       double commanded) const {
    const Robot& r = scene_.robot;
    const double k = r.friction_ratio;
    const double slip = std::max(std::hypot(slip_x, k * slip_y), 1e-9);
    const double behind = commanded == 0 ? 0 : commanded > 0 ? -x : x;
    const double front = 0.5 * r.length_m + behind;
    const double shear = slip * front / (std::abs(tread) + kShearRate_m_s);
    const double c = friction_at(x, y) * load * -std::expm1(-shear / r.shear_m) / slip;
    return {c, k * k * c};
  }

  void advance(const std::array<double, 2>& treads, const std::array<double, 2>& commanded) {
    const Robot& r = scene_.robot;
    const Eigen::Vector3d inertia(r.mass_kg, r.mass_kg, inertia_);
    // Unknown: the velocity of the centre of mass in the robot's frame, and the spin.
    Eigen::Matrix3d a = (inertia / kStep_s).asDiagonal();
    Eigen::Vector3d b = (inertia / kStep_s).cwiseProduct(velocity_);
    b.head<2>() += r.mass_kg * downhill();
    a.diagonal().head<2>().array() += nap_drag();
    const Loads load = loads();
    for (std::size_t side = 0; side < 2; ++side) {
      for (std::size_t i = 0; i < kStrips; ++i) {
        const double x = ahead(i), y = aside(side);
        const double rx = x - scene_.com_x_m, ry = y - scene_.com_y_m;
        const double u = velocity_[0] - ry * velocity_[2], w = velocity_[1] + rx * velocity_[2];
        const double tread = treads[side];
        const Eigen::Vector2d c = grip(x, y, load[side][i], u - tread, w, tread, commanded[side]);
        const Eigen::Vector2d d(c.x() + rolling_drag(load[side][i], u), c.y());
        a(0, 0) += d.x();
        a(0, 2) -= d.x() * ry;
        a(1, 1) += d.y();
        a(1, 2) += d.y() * rx;
        a(2, 2) += d.x() * ry * ry + d.y() * rx * rx;
        b[0] += c.x() * tread;
        b[2] -= c.x() * ry * tread;
      }
    }
    a(2, 0) = a(0, 2);
    a(2, 1) = a(1, 2);
    move(a.ldlt().solve(b));
  }

  void move(const Eigen::Vector3d& velocity) {
    const Eigen::Vector2d change = (velocity - velocity_).head<2>() / kStep_s;
    pull_ += (change - pull_) * (kStep_s / kLoadLag_s);
    const Pose X_RC{scene_.com_x_m, scene_.com_y_m, 0};
    const Pose X_WC = X_WR_ * X_RC;
    // The velocity's arrow stays where it points in the world while the robot turns under it.
    const double turn = velocity[2] * kStep_s, c = std::cos(X_WC.theta), s = std::sin(X_WC.theta);
    const Pose X_WD{X_WC.x + kStep_s * (c * velocity[0] - s * velocity[1]),
                    X_WC.y + kStep_s * (s * velocity[0] + c * velocity[1]),
                    wrap_angle(X_WC.theta + turn)};
    X_WR_ = X_WD * inverse(X_RC);
    velocity_ << Eigen::Rotation2Dd(-turn) * velocity.head<2>(), velocity[2];
  }

  Scene scene_;
  double inertia_ = 0;
  Pose X_WR_;
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();  // of the centre of mass, robot's frame
  Eigen::Vector2d pull_ = Eigen::Vector2d::Zero();      // its acceleration, lagged
};

}  // namespace

EngineKind planar_engine() {
  return {"planar", [](const Scene& scene) { return std::make_unique<PlanarEngine>(scene); }, {}};
}

}  // namespace gapfarm::truths
