#include "worker/sim/push/face.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace gapfarm {
namespace {

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

std::vector<FacePoint> face_points(const PushSettings& settings) {
  std::vector<FacePoint> face = even_cuts(settings);
  draw_out(settings, face);
  move_load({settings.com_x_m, settings.com_y_m}, face);
  return face;
}

Eigen::Vector3d face_resistance(const std::vector<FacePoint>& face, const Eigen::Vector2d& centre,
                                const Eigen::Vector2d& velocity, double spin) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const FacePoint& point : face) {
    const Eigen::Vector2d r = point.p - centre;
    const Eigen::Vector2d u = velocity + spin * Eigen::Vector2d(-r[1], r[0]);
    const double turned = point.extent_m * spin;
    const double speed = std::sqrt(u.squaredNorm() + turned * turned);
    if (speed == 0) continue;
    sum -= point.share / speed * Eigen::Vector3d(u[0], u[1], cross(r, u) + point.extent_m * turned);
  }
  return sum;
}

}  // namespace gapfarm
