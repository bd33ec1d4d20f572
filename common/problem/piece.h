// Flat pieces: what a push log's objects look like.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/pose/pose.h"

namespace gapfarm {

// A convex polygon of even thickness and density.
struct Piece {
  std::string name;
  // m, counter-clockwise, in the frame whose pose the log holds.
  std::vector<Eigen::Vector2d> corners;
  double thickness_m = 0.01;
  double mass_kg = 0.1;
  // Turned by a whole multiple of 2 pi / symmetry about its centroid it looks the same to whatever
  // measured its pose; 1: every corner is known from the others.
  unsigned symmetry = 1;

  bool operator==(const Piece&) const = default;
};

// Errors name the piece: fewer than 3 or more than 16 corners, not finite, beyond 2 m, clockwise,
// not convex, without area; thickness in (0, 0.5] m, mass in (0, 100] kg, symmetry in [1, 16].
Status check_piece(const Piece& piece);

// These REQUIRE a piece that check_piece() accepts.
double area(const Piece& piece);               // m^2
Eigen::Vector2d centroid(const Piece& piece);  // m, in the log's frame
// Second moments of area over area about the centroid, m^2: xx, yy, and xy.
Eigen::Vector3d second_moments(const Piece& piece);

Eigen::Vector2d transform(const Pose& X_AB, const Eigen::Vector2d& p_B);

// The pose that looks the same as `X_WP` and is nearest to `X_WM` by mean corner distance.
Pose nearest_alike(const Piece& piece, const Pose& X_WP, const Pose& X_WM);

// Mean distance, m, between the piece's corners at two poses, each corner with itself; for a
// symmetric piece at the nearest of the poses that look alike.  Weitnauer, Haschke and Ritter
// (2010) call it E.
double corner_distance(const Piece& piece, const Pose& X_WA, const Pose& X_WB);

}  // namespace gapfarm
