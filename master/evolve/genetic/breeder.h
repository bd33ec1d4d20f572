// Makes children: picks parents, picks operators, applies them, and learns which operators pay.
#pragma once

#include <vector>

#include "common/config/settings.h"
#include "master/evolve/gene_space.h"
#include "master/evolve/genetic/variation.h"
#include "master/evolve/individual.h"

namespace gapfarm {

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
