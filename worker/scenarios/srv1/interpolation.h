// Interpolation of smooth functions from few nodes.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gapfarm {

// Equally spaced headings 2 pi k / n, k = 0..n-1.  REQUIRES: n even.
std::vector<double> heading_nodes(std::size_t n);

// Trigonometric interpolation through values at heading_nodes(n): exact for harmonics below n/2.
// The values may hold every `stride`-th node only.
Eigen::Vector3d interpolate_heading(std::span<const Eigen::Vector3d> values, double heading_rad,
                                    std::size_t stride = 1);

// Chebyshev-Lobatto nodes on [lower, upper].  REQUIRES: n >= 2.
std::vector<double> chebyshev_nodes(double lower, double upper, std::size_t n);

// Polynomial through values at chebyshev_nodes (barycentric form, Berrut and Trefethen 2004).
Eigen::Vector3d interpolate_chebyshev(std::span<const double> nodes,
                                      std::span<const Eigen::Vector3d> values, double at);

}  // namespace gapfarm
