// How large one prediction's errors are beside another's, and how sure that is.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace gapfarm {

// Of two medians over the same windows.
struct DrawnRatio {
  double ratio = 1;
  std::optional<std::array<double, 2>> interval;  // 90 %; none where too few windows show
};

// `run` of each window, in driving order; the interval is by drawing runs again, one less than
// there are, or, of fewer than ten runs, tenths of the windows within them. REQUIRES: as many
// errors of either, and runs.
DrawnRatio drawn_ratio(std::span<const double> own, std::span<const double> baseline,
                       std::span<const std::size_t> run, std::uint64_t seed);

}  // namespace gapfarm
