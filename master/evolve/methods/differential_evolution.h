// Differential evolution, DE/rand/1/bin (Storn and Price, J. Global Optimization 11, 1997).
//
// Ordered genes evolve as reals and are snapped when scored.  An unordered gene takes its value
// from one of the three donors.  When the whole population has become one point, all but the best
// are drawn anew.
#pragma once

#include "master/evolve/methods/search_method.h"

namespace gapfarm {

class DifferentialEvolution final : public SearchMethod {
 public:
  explicit DifferentialEvolution(const MethodSetup& setup);

  std::vector<Genome> propose(const StreamOf& stream_of) const override;
  void learn(std::span<const Genome> proposed, std::span<const Standing> standings) override;
  unsigned origin() const override { return population_.empty() ? kRandom : kDifference; }
  void save(v1::MethodState& message) const override;
  Status restore(const v1::MethodState& message) override;

  std::size_t iterations() const { return iterations_; }
  bool has_population() const { return !population_.empty(); }
  // REQUIRES: has_population().
  const Individual& best() const;

 private:
  Genome trial_vector(std::size_t target, Stream& stream) const;
  bool converged() const;

  MethodSetup setup_;
  std::size_t size_;
  std::size_t iterations_ = 0;
  std::vector<Individual> population_;  // empty: to be drawn
  Genome keep_;                         // of the next draw; empty: none
};

}  // namespace gapfarm
