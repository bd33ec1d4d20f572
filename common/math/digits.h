// Numbers as people read them.
#pragma once

#include <cmath>

namespace gapfarm {

// `value` to so many significant digits, so that small values do not vanish.
inline double rounded_to_digits(double value, int digits) {
  if (value == 0 || !std::isfinite(value)) return value;
  const double unit = std::pow(10.0, digits - 1 - std::floor(std::log10(std::abs(value))));
  return std::round(value * unit) / unit;
}

}  // namespace gapfarm
