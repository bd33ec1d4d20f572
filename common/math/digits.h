// Numbers as people read them.
#pragma once

#include <charconv>
#include <cmath>

namespace gapfarm {

// The number that `value` is when it is written with so many significant digits: small values do
// not vanish, and its shortest text is no longer.  0 digits: as it is.
inline double rounded_to_digits(double value, int digits) {
  if (digits <= 0 || !std::isfinite(value)) return value;
  char text[64];
  const auto end =
      std::to_chars(text, text + sizeof text, value, std::chars_format::scientific, digits - 1);
  std::from_chars(text, end.ptr, value);
  return value;
}

}  // namespace gapfarm
