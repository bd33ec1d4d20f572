// Parent selection by rank alone, so that neither the unit of the cost nor the order in which the
// population is stored matters.
#pragma once

#include <vector>

#include "common/config/settings.h"
#include "common/random/stream.h"

namespace gapfarm {

class Selection {
 public:
  // Over ranks 0 (best) to count - 1.  REQUIRES: count > 0.
  Selection(const EvolutionSettings& settings, std::size_t count);

  // Probability of each rank.
  //   tournament of k with replacement: ((n - r)^k - (n - r - 1)^k) / n^k
  //   linear ranking with pressure s (Baker 1985): (s - 2 (s - 1) r / (n - 1)) / n
  const std::vector<double>& probabilities() const { return probabilities_; }

  std::size_t pick(Stream& stream) const;

 private:
  std::vector<double> probabilities_;
  std::vector<double> cumulative_;
};

}  // namespace gapfarm
