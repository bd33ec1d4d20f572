// Functions of several costs whose fronts are known in closed form: ZDT1 and ZDT2 (Zitzler, Deb and
// Thiele 2000), DTLZ2 (Deb, Thiele, Laumanns and Zitzler 2002), genes in [0, 1].
#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "common/math/fronts.h"

namespace gapfarm {

struct FrontFunction {
  std::string name;
  std::size_t genes = 0, costs = 0;
  Costs (*value)(const std::vector<double>& x) = nullptr;
  double volume = 0;  // of the front itself within (1, 1) or (1, 1, 1)
};

inline Costs zdt(const std::vector<double>& x, double power) {
  double g = 1;
  for (std::size_t i = 1; i < x.size(); ++i) g += 9 * x[i] / static_cast<double>(x.size() - 1);
  return {x[0], g * (1 - std::pow(x[0] / g, power))};
}

inline std::vector<FrontFunction> front_functions() {
  return {{"ZDT1", 30, 2, [](const std::vector<double>& x) { return zdt(x, 0.5); }, 2.0 / 3},
          {"ZDT2", 30, 2, [](const std::vector<double>& x) { return zdt(x, 2); }, 1.0 / 3},
          {"DTLZ2", 12, 3,
           [](const std::vector<double>& x) -> Costs {
             double g = 1;
             for (std::size_t i = 2; i < x.size(); ++i) g += (x[i] - 0.5) * (x[i] - 0.5);
             const double a = x[0] * std::numbers::pi / 2, b = x[1] * std::numbers::pi / 2;
             return {g * std::cos(a) * std::cos(b), g * std::cos(a) * std::sin(b), g * std::sin(a)};
           },
           1 - std::numbers::pi / 6}};
}

}  // namespace gapfarm
