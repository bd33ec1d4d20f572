#include "master/evolve/genetic/selection.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace gapfarm {

Selection::Selection(const EvolutionSettings& settings, std::size_t count) {
  assert(count > 0);
  const auto n = static_cast<double>(count);
  for (std::size_t rank = 0; rank < count; ++rank) {
    const auto r = static_cast<double>(rank);
    if (settings.selection == SelectionKind::kTournament) {
      const double k = std::max(1U, settings.tournament_size);
      probabilities_.push_back(std::pow((n - r) / n, k) - std::pow((n - r - 1) / n, k));
    } else {
      const double s = settings.rank_pressure;
      probabilities_.push_back(count == 1 ? 1 : (s - 2 * (s - 1) * r / (n - 1)) / n);
    }
  }
  cumulative_.resize(count);
  std::partial_sum(probabilities_.begin(), probabilities_.end(), cumulative_.begin());
}

std::size_t Selection::pick(Stream& stream) const {
  const double draw = stream.uniform() * cumulative_.back();
  const auto found = std::upper_bound(cumulative_.begin(), cumulative_.end(), draw);
  return std::min(static_cast<std::size_t>(found - cumulative_.begin()), cumulative_.size() - 1);
}

}  // namespace gapfarm
