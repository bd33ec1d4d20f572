// Operator probabilities that are earned: probability matching (Goldberg 1990; with a floor as in
// Thierens, GECCO 2005).
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/random/stream.h"

namespace gapfarm {

// What the children of one operator achieved in a generation.
struct Credit {
  double progress = 0;  // summed over its children, each in [0, 1]
  unsigned children = 0;
};

// Arms that exclude one another.  Each arm has a quality Q, the running mean of its children's
// progress (weight 0.2 for a new generation); its probability is floor + (1 - K floor) Q / sum(Q).
class Roulette {
 public:
  // `start`: one probability an arm, summing to 1.  `floor` is lowered to 1 / K when K arms could
  // not have it.  Without adaptation the start probabilities stay.
  Roulette(std::vector<std::string> names, std::vector<double> start, double floor, bool adaptive);

  const std::vector<std::string>& names() const { return names_; }
  const std::vector<double>& probabilities() const { return probabilities_; }
  std::size_t pick(Stream& stream) const;
  // An arm other than `arm`, in proportion to the others' probabilities.  REQUIRES: two arms.
  std::size_t pick_other(std::size_t arm, Stream& stream) const;

  // One credit an arm.  An arm without children keeps its quality.
  void learn(std::span<const Credit> credits);

  // Qualities, to save; restoring them restores the probabilities to the bit.
  const std::vector<double>& qualities() const { return qualities_; }
  // REQUIRES: one quality an arm.
  void restore(std::vector<double> qualities);

 private:
  void update_probabilities();

  std::vector<std::string> names_;
  double floor_ = 0;
  bool adaptive_ = false;
  std::vector<double> qualities_;
  std::vector<double> probabilities_;
};

}  // namespace gapfarm
