// Distances between two sampled paths.  Points in any unit; the distance has it too.  All take time
// proportional to the product of the paths' lengths, but Lettier's.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

namespace gapfarm {

using PathPoint = Eigen::Vector3d;

// Greatest distance between points of the same index; the shorter path waits at its last point
// (Lettier 2013).  What it calls near depends on how both were sampled.
// REQUIRES of all three: both paths not empty.
double lettier_distance(std::span<const PathPoint> a, std::span<const PathPoint> b);

// Greatest distance from a point of one path to the nearest of the other; order does not matter.
double hausdorff_distance(std::span<const PathPoint> a, std::span<const PathPoint> b);

// Discrete Frechet distance: the shortest leash with which both paths can be walked from end to end
// without a step back, by dynamic programming (Eiter and Mannila 1994).
double frechet_distance(std::span<const PathPoint> a, std::span<const PathPoint> b);

using PathDistance = double (*)(std::span<const PathPoint>, std::span<const PathPoint>);

struct NamedPathDistance {
  const char* name;   // for programs
  const char* title;  // for people
  PathDistance distance;
};
inline constexpr std::array<NamedPathDistance, 3> kPathDistances = {
    {{"frechet", "Frechet", frechet_distance},
     {"hausdorff", "Hausdorff", hausdorff_distance},
     {"lettier", "Lettier", lettier_distance}}};

}  // namespace gapfarm
