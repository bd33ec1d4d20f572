#include "worker/sim/push/face_step.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace gapfarm {
namespace {

constexpr double kCreep_m_s = 1e-6;  // below it friction falls to zero: it has no corner there
constexpr int kMostIterations = 60;
constexpr int kMostCases = 8;
constexpr double kClose = 1e-9;      // of the fastest speed: the last step of the search
constexpr double kLeast_m_s = 1e-9;  // and never less than this

struct Resistance {
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
};

// Of the dissipation.  Without `curved` the Hessian is that of a quadratic above it that touches it
// here: steps with it never overshoot.
Resistance resistance(const FaceStep::Points& points, const Eigen::Vector3d& V, bool curved) {
  double g0 = 0, g1 = 0, g2 = 0;
  double h00 = 0, h01 = 0, h02 = 0, h11 = 0, h12 = 0, h22 = 0;
  const double qx = points.q_x, qy = points.q_y, keep = curved ? 1 : 0;
  const std::size_t n = points.x.size();
  for (std::size_t i = 0; i < n; ++i) {
    const double x = points.x[i], y = points.y[i], e2 = points.extent[i] * points.extent[i];
    const double ux = V[0] - V[2] * y, uy = V[1] + V[2] * x;
    const double rho2 = qx * ux * ux + qy * uy * uy + e2 * V[2] * V[2] + kCreep_m_s * kCreep_m_s;
    const double rho = std::sqrt(rho2);
    const double k = points.impulse[i] / rho;
    // J' Q z, and from it the gradient.
    const double a = qx * ux, b = qy * uy;
    const double c = x * b - y * a + e2 * V[2];
    g0 += k * a;
    g1 += k * b;
    g2 += k * c;
    const double l = keep * k / rho2;
    h00 += k * qx - l * a * a;
    h01 -= l * a * b;
    h02 -= k * qx * y + l * a * c;
    h11 += k * qy - l * b * b;
    h12 += k * qy * x - l * b * c;
    h22 += k * (qx * y * y + qy * x * x + e2) - l * c * c;
  }
  Resistance r;
  r.gradient << g0, g1, g2;
  r.hessian << h00, h01, h02, h01, h11, h12, h02, h12, h22;
  return r;
}

Eigen::Vector3d row(const Eigen::Vector2d& direction, const Eigen::Vector2d& arm) {
  return {direction[0], direction[1], arm[0] * direction[1] - arm[1] * direction[0]};
}

Eigen::Vector2d left_of(const Eigen::Vector2d& d) { return {-d[1], d[0]}; }

// What the contact asks of the velocity: rows V + diag(give) p = wanted for an impulse that acts by
// pushes' columns.
struct Conditions {
  int count = 0;
  Eigen::Matrix<double, 2, 3> rows = Eigen::Matrix<double, 2, 3>::Zero();
  Eigen::Matrix<double, 3, 2> pushes = Eigen::Matrix<double, 3, 2>::Zero();
  Eigen::Vector2d give = Eigen::Vector2d::Zero();
  Eigen::Vector2d wanted = Eigen::Vector2d::Zero();
};

Conditions conditions(FingerContact contact, const FingerTouch* touch, double dt_s) {
  Conditions c;
  if (touch == nullptr || contact == FingerContact::kApart) return c;
  const Eigen::Vector3d normal = row(touch->inward, touch->arm);
  const Eigen::Vector3d left = row(left_of(touch->inward), touch->arm);
  c.count = 1;
  c.rows.row(0) = normal.transpose();
  c.pushes.col(0) = normal;
  c.give[0] = touch->compliance_m_n / (dt_s * dt_s);
  c.wanted[0] = -touch->gap_m / dt_s;
  if (contact == FingerContact::kSticks) {
    c.count = 2;
    c.rows.row(1) = left.transpose();
    c.pushes.col(1) = left;
    c.wanted[1] = left_of(touch->inward).dot(touch->velocity);
  } else {
    const double side = contact == FingerContact::kSlidesLeft ? 1 : -1;
    c.pushes.col(0) += side * touch->friction * left;
  }
  return c;
}

}  // namespace

Eigen::Vector3d FaceStep::solve_case(const Points& points, const Eigen::Vector3d& free,
                                     Eigen::Vector3d V, const FingerTouch* touch, double dt_s) {
  const Conditions c = conditions(contact_, touch, dt_s);
  const double gyration = std::sqrt(mass_[2] / mass_[0]);
  const auto speed = [&](const Eigen::Vector3d& W) {
    return std::max({std::abs(W[0]), std::abs(W[1]), gyration * std::abs(W[2])});
  };
  const double fastest =
      std::max(speed(free), touch == nullptr ? 0.0 : touch->velocity.cwiseAbs().maxCoeff());
  const double close = std::max(kClose * fastest, kLeast_m_s);
  bool curved = true;
  Resistance r = resistance(points, V, curved);
  for (int k = 0; k < kMostIterations; ++k) {
    ++iterations_;
    Eigen::Matrix3d H = r.hessian;
    H.diagonal() += mass_;
    const Eigen::Vector3d residual = mass_.cwiseProduct(V - free) + r.gradient;
    const Eigen::Matrix3d inverse = H.inverse();
    Eigen::Vector2d p = Eigen::Vector2d::Zero();
    const Eigen::Vector2d lacking = c.wanted - c.rows * (V - inverse * residual);
    const Eigen::Matrix2d gained = c.rows * inverse * c.pushes;
    if (c.count == 1) p[0] = lacking[0] / (gained(0, 0) + c.give[0]);
    if (c.count == 2) {
      Eigen::Matrix2d both = gained;
      both.diagonal() += c.give;
      p = both.inverse() * lacking;
    }
    const Eigen::Vector3d step = inverse * (c.pushes * p - residual);
    impulse_ = p;
    const Eigen::Vector3d to = V + step;
    if (speed(step) < close) return to;
    // Along the step the work that is left falls from `before` through zero; where it comes out far
    // beyond, back to where it would be zero if it fell evenly, and on with the careful Hessian.
    const double before = -step.dot(H * step);
    curved = true;
    r = resistance(points, to, curved);
    const Eigen::Vector3d left = mass_.cwiseProduct(to - free) + r.gradient - c.pushes * p;
    const double after = step.dot(left);
    if (after > -0.5 * before) {
      V += before / (before - after) * step;
      curved = false;
      r = resistance(points, V, curved);
    } else {
      V = to;
    }
  }
  return V;
}

FingerContact FaceStep::required(const Eigen::Vector3d& V, const FingerTouch& touch,
                                 double dt_s) const {
  const Eigen::Vector2d left = left_of(touch.inward);
  const double slip = row(left, touch.arm).dot(V) - left.dot(touch.velocity);
  switch (contact_) {
    case FingerContact::kApart: {
      const double gap = touch.gap_m + dt_s * row(touch.inward, touch.arm).dot(V);
      return gap < 0 ? FingerContact::kSticks : FingerContact::kApart;
    }
    case FingerContact::kSticks: {
      if (impulse_[0] < 0) return FingerContact::kApart;
      if (std::abs(impulse_[1]) <= touch.friction * impulse_[0]) return FingerContact::kSticks;
      return impulse_[1] > 0 ? FingerContact::kSlidesLeft : FingerContact::kSlidesRight;
    }
    // The piece is pushed to the side that it lags behind on.
    case FingerContact::kSlidesLeft:
      if (impulse_[0] < 0) return FingerContact::kApart;
      return slip > 0 ? FingerContact::kSticks : FingerContact::kSlidesLeft;
    case FingerContact::kSlidesRight:
      if (impulse_[0] < 0) return FingerContact::kApart;
      return slip < 0 ? FingerContact::kSticks : FingerContact::kSlidesRight;
  }
  return contact_;
}

Eigen::Vector3d FaceStep::solve(const Points& points, const Eigen::Vector3d& free,
                                const Eigen::Vector3d& from, const FingerTouch* touch,
                                double dt_s) {
  impulse_.setZero();
  if (touch == nullptr) contact_ = FingerContact::kApart;
  Eigen::Vector3d V = from;
  for (int k = 0; k < kMostCases; ++k) {
    V = solve_case(points, free, V, touch, dt_s);
    if (touch == nullptr) return V;
    const FingerContact next = required(V, *touch, dt_s);
    if (next == contact_) return V;
    contact_ = next;
  }
  // Where cases follow each other in a circle a finger that sticks is always possible.
  contact_ = FingerContact::kSticks;
  return solve_case(points, free, V, touch, dt_s);
}

}  // namespace gapfarm
