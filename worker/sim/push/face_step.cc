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
// here, of which the gradient is this one's, too: steps with it never overshoot.  Sums go over
// every kBlock-th point, and are put together at the end, because this is where a worker spends
// most of its time.
Resistance resistance(const FaceStep::Points& points, const Eigen::Vector3d& V, bool curved) {
  using Block = Eigen::Array<double, FaceStep::kBlock, 1>;
  Block k0 = Block::Zero(), kx = k0, ky = k0, kr = k0;
  Block aa = k0, ab = k0, ac = k0, bb = k0, bc = k0, cc = k0;
  const double qx = points.q_x, qy = points.q_y;
  for (std::size_t i = 0; i < points.x.size(); i += FaceStep::kBlock) {
    const Block x = Block::Map(&points.x[i]), y = Block::Map(&points.y[i]);
    const Block e2 = Block::Map(&points.extent[i]).square();
    const Block ux = V[0] - V[2] * y, uy = V[1] + V[2] * x;
    const Block a = qx * ux, b = qy * uy;
    const Block per_rho2 = 1 / (a * ux + b * uy + e2 * (V[2] * V[2]) + kCreep_m_s * kCreep_m_s);
    const Block k = Block::Map(&points.impulse[i]) * per_rho2.sqrt();
    k0 += k;
    kx += k * x;
    ky += k * y;
    kr += k * (qx * y * y + qy * x * x + e2);
    if (!curved) continue;
    const Block c = x * b - y * a + e2 * V[2];
    const Block l = k * per_rho2, la = l * a, lb = l * b;
    aa += la * a;
    ab += la * b;
    ac += la * c;
    bb += lb * b;
    bc += lb * c;
    cc += l * c * c;
  }
  const double h00 = qx * k0.sum(), h11 = qy * k0.sum(), h02 = -qx * ky.sum(), h12 = qy * kx.sum();
  Resistance r;
  r.hessian << h00, 0, h02, 0, h11, h12, h02, h12, kr.sum();
  r.gradient = r.hessian * V;
  Eigen::Matrix3d bent;
  bent << aa.sum(), ab.sum(), ac.sum(), ab.sum(), bb.sum(), bc.sum(), ac.sum(), bc.sum(), cc.sum();
  r.hessian -= bent;
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

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a[0] * b[1] - a[1] * b[0];
}

// The face in triangles from the centroid to each edge, these in rings of equal load and slices of
// equal width: with s^(2 pressure) = sigma, load is even over sigma.
std::vector<FacePoint> even_cuts(const PushSettings& settings) {
  const std::vector<Eigen::Vector2d>& corners = settings.corners;
  const double edges = static_cast<double>(corners.size());
  const int rings = std::max(
      1,
      static_cast<int>(std::lround(std::sqrt(static_cast<double>(settings.face_points) / edges))));
  const int slices =
      std::max(1, static_cast<int>(std::ceil(settings.face_points / (edges * rings))));
  double doubled_area = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    doubled_area += cross(corners[i], corners[(i + 1) % corners.size()]);
  }
  const double power = 2 * settings.pressure;
  const auto edge_of = [&](int ring) {
    return std::pow(static_cast<double>(ring) / rings, 1 / power);
  };
  std::vector<FacePoint> face;
  for (int k = 0; k < rings; ++k) {
    const double inner = edge_of(k), outer = edge_of(k + 1);
    // The mean of s over the ring's load.
    const double s =
        rings * power / (power + 1) * (std::pow(outer, power + 1) - std::pow(inner, power + 1));
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Eigen::Vector2d& a = corners[i];
      const Eigen::Vector2d& b = corners[(i + 1) % corners.size()];
      const double triangle = cross(a, b);
      for (int j = 0; j < slices; ++j) {
        FacePoint point;
        point.p = s * (a + (j + 0.5) / slices * (b - a));
        point.share = triangle / (doubled_area * rings * slices);
        // Of a parallelogram about as wide as it is high.
        const double area = triangle / 2 * (outer * outer - inner * inner) / slices;
        point.extent_m = std::sqrt(area / 12);
        face.push_back(point);
      }
    }
  }
  return face;
}

void draw_out(const PushSettings& settings, std::vector<FacePoint>& face) {
  if (settings.stretch == 0) return;
  const Eigen::Vector2d along(std::cos(settings.stretch_direction_rad),
                              std::sin(settings.stretch_direction_rad));
  const Eigen::Vector2d across(-along[1], along[0]);
  const double longer = std::exp(settings.stretch / 2);
  for (FacePoint& point : face) {
    point.p = longer * along.dot(point.p) * along + across.dot(point.p) / longer * across;
  }
}

// Loads times exp(slope . p) whose centre is `centre`: Newton's method on the convex logarithm of
// their sum.  A centre outside the face ends with the load on its nearest points.
void move_load(const Eigen::Vector2d& centre, std::vector<FacePoint>& face) {
  constexpr int kMostRounds = 30;
  if (centre.isZero(0)) return;
  double reach = 0;
  for (const FacePoint& point : face) reach = std::max(reach, point.p.norm());
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  std::vector<double> loads(face.size());
  for (int round = 0; round < kMostRounds; ++round) {
    double sum = 0;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
    for (std::size_t i = 0; i < face.size(); ++i) {
      loads[i] = face[i].share * std::exp(slope.dot(face[i].p - centre));
      sum += loads[i];
      mean += loads[i] * face[i].p;
      second += loads[i] * face[i].p * face[i].p.transpose();
    }
    mean /= sum;
    for (double& load : loads) load /= sum;
    const Eigen::Vector2d off = centre - mean;
    if (off.norm() < 1e-14 * reach) break;
    Eigen::Matrix2d cov = second / sum - mean * mean.transpose();
    cov.diagonal().array() += 1e-6 * reach * reach;
    Eigen::Vector2d step = cov.ldlt().solve(off);
    // No more than a factor e from one side to the other at a time.
    step *= std::min(1.0, 1 / (step.norm() * reach));
    slope += step;
  }
  for (std::size_t i = 0; i < face.size(); ++i) face[i].share = loads[i];
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
  double last = 0;  // how far the last step went
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
    // The next one would be shorter by at least as much as this one is than the last.
    const double moved = speed(step);
    if (moved < close || moved * moved < close * last) return to;
    last = moved;
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

std::vector<FacePoint> face_points(const PushSettings& settings) {
  std::vector<FacePoint> face = even_cuts(settings);
  draw_out(settings, face);
  move_load({settings.com_x_m, settings.com_y_m}, face);
  return face;
}

}  // namespace gapfarm
