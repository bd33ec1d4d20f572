// Fitness by generation.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gapfarm {

struct FitnessPoint {
  std::uint64_t generation = 0;
  std::optional<double> best, median, worst;  // none: no individual of the generation was OK
};

// Best (solid) and median (dashed) over the band from best to worst.  The scale follows the best
// and the bulk of the medians; what is worse is cut off at the frame.
std::string fitness_chart(const std::vector<FitnessPoint>& points, const std::string& title,
                          const std::string& fitness, const std::string& unit,
                          bool higher_is_better);

}  // namespace gapfarm
