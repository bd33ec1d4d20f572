#include "common/problem/piece.h"

#include <cmath>
#include <numbers>

namespace gapfarm {
namespace {

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a[0] * b[1] - a[1] * b[0];
}

// Twice the signed area.
double doubled_area(const Piece& piece) {
  double sum = 0;
  for (std::size_t i = 0; i < piece.corners.size(); ++i) {
    sum += cross(piece.corners[i], piece.corners[(i + 1) % piece.corners.size()]);
  }
  return sum;
}

double plain_corner_distance(const Piece& piece, const Pose& X_WA, const Pose& X_WB) {
  double sum = 0;
  for (const Eigen::Vector2d& corner : piece.corners) {
    sum += (transform(X_WA, corner) - transform(X_WB, corner)).norm();
  }
  return sum / static_cast<double>(piece.corners.size());
}

}  // namespace

Status check_piece(const Piece& piece) {
  const auto fail = [&](const std::string& what) {
    return Status(Error{"piece '" + piece.name + "' " + what});
  };
  if (piece.name.empty()) return Error{"a piece has no name"};
  const std::size_t n = piece.corners.size();
  if (n < 3 || n > 16) return fail("has " + std::to_string(n) + " corners, expected 3 to 16");
  for (const Eigen::Vector2d& corner : piece.corners) {
    // NaN fails every comparison that holds.
    if (!(corner.cwiseAbs().maxCoeff() <= 2)) {
      return fail("has a corner farther than 2 m from its frame; corners are in m");
    }
  }
  if (doubled_area(piece) < 0) return fail("has its corners clockwise; list them the other way");
  double turned = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d a = piece.corners[(i + 1) % n] - piece.corners[i];
    const Eigen::Vector2d b = piece.corners[(i + 2) % n] - piece.corners[(i + 1) % n];
    if (!(cross(a, b) > 1e-9)) {
      return fail("is not convex, or has three corners in a line, at its corner " +
                  std::to_string((i + 1) % n + 1));
    }
    turned += std::atan2(cross(a, b), a.dot(b));
  }
  if (turned > 3 * std::numbers::pi) return fail("has an outline that goes round more than once");
  if (!(piece.thickness_m > 0 && piece.thickness_m <= 0.5)) {
    return fail("needs a thickness above 0 and up to 0.5 m");
  }
  if (!(piece.mass_kg > 0 && piece.mass_kg <= 100)) {
    return fail("needs a mass above 0 and up to 100 kg");
  }
  if (piece.symmetry < 1 || piece.symmetry > 16) return fail("needs a symmetry of 1 to 16");
  return {};
}

double area(const Piece& piece) { return doubled_area(piece) / 2; }

Eigen::Vector2d centroid(const Piece& piece) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  const std::size_t n = piece.corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d& a = piece.corners[i];
    const Eigen::Vector2d& b = piece.corners[(i + 1) % n];
    sum += cross(a, b) * (a + b);
  }
  return sum / (3 * doubled_area(piece));
}

Eigen::Vector3d second_moments(const Piece& piece) {
  const Eigen::Vector2d middle = centroid(piece);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const std::size_t n = piece.corners.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d a = piece.corners[i] - middle;
    const Eigen::Vector2d b = piece.corners[(i + 1) % n] - middle;
    const double w = cross(a, b);
    sum[0] += w * (a[0] * a[0] + a[0] * b[0] + b[0] * b[0]);
    sum[1] += w * (a[1] * a[1] + a[1] * b[1] + b[1] * b[1]);
    sum[2] += w * (a[0] * a[1] + (a[0] * b[1] + b[0] * a[1]) / 2 + b[0] * b[1]);
  }
  return sum / (6 * doubled_area(piece));
}

Eigen::Vector2d transform(const Pose& X_AB, const Eigen::Vector2d& p_B) {
  const double c = std::cos(X_AB.theta);
  const double s = std::sin(X_AB.theta);
  return {X_AB.x + c * p_B[0] - s * p_B[1], X_AB.y + s * p_B[0] + c * p_B[1]};
}

Pose nearest_alike(const Piece& piece, const Pose& X_WP, const Pose& X_WM) {
  Pose nearest = X_WP;
  if (piece.symmetry == 1) return nearest;
  double least = plain_corner_distance(piece, X_WP, X_WM);
  const Eigen::Vector2d middle = centroid(piece);
  const Pose X_PC{middle[0], middle[1], 0};
  for (unsigned k = 1; k < piece.symmetry; ++k) {
    const Pose turn{0, 0, wrap_angle(2 * std::numbers::pi * k / piece.symmetry)};
    const Pose alike = X_WP * X_PC * turn * inverse(X_PC);
    const double distance = plain_corner_distance(piece, alike, X_WM);
    if (distance < least) {
      least = distance;
      nearest = alike;
    }
  }
  return nearest;
}

double corner_distance(const Piece& piece, const Pose& X_WA, const Pose& X_WB) {
  return plain_corner_distance(piece, nearest_alike(piece, X_WA, X_WB), X_WB);
}

}  // namespace gapfarm
