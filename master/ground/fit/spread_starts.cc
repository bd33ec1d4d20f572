#include <cmath>

#include "master/ground/fit/simulated_start.h"

namespace gapfarm {

std::vector<Genome> spread_starts(const Genome& middle, std::span<const std::size_t> free,
                                  std::size_t count) {
  constexpr double kReach = 0.3;  // of a gene's range, either way
  // The root of x^(d+1) = x + 1: its powers fill d dimensions most evenly (Roberts 2018).
  double root = 1.5;
  for (int k = 0; k < 60; ++k) {
    root = std::pow(1 + root, 1 / (static_cast<double>(free.size()) + 1));
  }
  std::vector<Genome> starts(count, middle);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t d = 0; d < free.size(); ++d) {
      const double turn =
          0.5 + static_cast<double>(k + 1) * std::pow(root, -static_cast<double>(d + 1));
      double& value = starts[k][free[d]];
      value = std::abs(value + kReach * (2 * (turn - std::floor(turn)) - 1));  // bounds reflect
      if (value > 1) value = 2 - value;
    }
  }
  return starts;
}

}  // namespace gapfarm
