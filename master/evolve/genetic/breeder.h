// Makes children: picks parents, picks operators, applies them, and learns which operators pay.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/config/settings.h"
#include "common/random/stream.h"
#include "master/evolve/individual.h"

namespace gapfarm {

// One child of two parents of the same space.
//   one_point: a's genes before a cut, b's from it on; the cut leaves each at least one gene.
//   uniform:   each gene from either with equal probability.
//   blend:     each gene by GeneSpace::blended() with `alpha`.
Genome crossed(CrossoverKind kind, const Genome& a, const Genome& b, const GeneSpace& space,
               double alpha, Stream& stream);

// Changes each gene with probability `share`, and one of them at least.
//   gaussian:      GeneSpace::stepped() with `sigma`.
//   uniform_reset: a new uniform draw.
Genome mutated(MutationKind kind, Genome genome, const GeneSpace& space, double share, double sigma,
               Stream& stream);

// Parent selection by rank alone, so that neither the unit of the cost nor the order in which the
// population is stored matters.
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

// Operator probabilities that are earned: probability matching (Goldberg 1990; with a floor as in
// Thierens, GECCO 2005).

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

struct Child {
  Genome genome;
  std::vector<std::size_t> parents;  // ranks; two after a crossover
  unsigned origin = 0;
  struct Arm {
    std::size_t roulette, index;
  };
  std::vector<Arm> arms;  // the roulettes' choices that made it
};

class Breeder {
 public:
  // Separately: one roulette holds all crossovers and mutations.  In sequence: one holds "no
  // crossover" and the crossovers, another "no mutation" and the mutations; a child that neither
  // would change gets one of the two after all.
  // REQUIRES: at least one operator.
  Breeder(const EvolutionSettings& settings, GeneSpace space);

  const GeneSpace& space() const { return space_; }

  // REQUIRES: `ranked` is best first and not empty.
  Child breed(const std::vector<Individual>& ranked, const Selection& selection,
              Stream& stream) const;

  // A child and how far it came: the share of all compared individuals that lie strictly between
  // it and its better parent, 0 when it is no better.  Scale-free: only ranks count.
  struct Progress {
    std::vector<Child::Arm> arms;
    double progress = 0;
  };
  void learn(const std::vector<Progress>& children);

  std::vector<NamedNumber> probabilities() const;
  std::vector<double> qualities() const;
  // False when the number of qualities is not that of the operators.
  bool restore(const std::vector<double>& qualities);

 private:
  std::vector<Child::Arm> pick_arms(Stream& stream) const;

  EvolutionSettings settings_;
  GeneSpace space_;
  std::vector<Roulette> roulettes_;
};

}  // namespace gapfarm
