#include "worker/scenarios/srv1/interpolation.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace gapfarm {

std::vector<double> heading_nodes(std::size_t n) {
  assert(n % 2 == 0);
  std::vector<double> nodes;
  for (std::size_t k = 0; k < n; ++k) {
    nodes.push_back(2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n));
  }
  return nodes;
}

Eigen::Vector3d interpolate_heading(std::span<const Eigen::Vector3d> values, double heading_rad,
                                    std::size_t stride) {
  const std::size_t n = values.size() / stride;
  const std::vector<double> nodes = heading_nodes(n);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < n; ++k) {
    const double delta = heading_rad - nodes[k];
    const double half = std::sin(delta / 2);
    if (std::abs(half) < 1e-12) return values[k * stride];
    // The cardinal function sin(n d / 2) / (n tan(d / 2)) of n (even) equispaced nodes.
    const auto count = static_cast<double>(n);
    sum += std::sin(count * delta / 2) * std::cos(delta / 2) / (count * half) * values[k * stride];
  }
  return sum;
}

std::vector<double> chebyshev_nodes(double lower, double upper, std::size_t n) {
  assert(n >= 2);
  std::vector<double> nodes;
  for (std::size_t k = 0; k < n; ++k) {
    const double angle = std::numbers::pi * static_cast<double>(k) / static_cast<double>(n - 1);
    nodes.push_back((lower + upper) / 2 - (upper - lower) / 2 * std::cos(angle));
  }
  return nodes;
}

Eigen::Vector3d interpolate_chebyshev(std::span<const double> nodes,
                                      std::span<const Eigen::Vector3d> values, double at) {
  Eigen::Vector3d above = Eigen::Vector3d::Zero();
  double below = 0;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (at == nodes[k]) return values[k];
    double weight = k % 2 == 0 ? 1 : -1;
    if (k == 0 || k + 1 == nodes.size()) weight /= 2;
    weight /= at - nodes[k];
    above += weight * values[k];
    below += weight;
  }
  return above / below;
}

}  // namespace gapfarm
