// Differential evolution that adapts itself: DE/current-to-pbest/1/bin with an archive and a memory
// of the weights and crossover rates that were of use (SHADE; Tanabe and Fukunaga, CEC 2013), each
// success counting alike, so that costs matter by their order alone.  With a weight or a rate in
// the settings: DE/rand/1/bin (Storn and Price, J. Global Optimization 11, 1997).
//
// Ordered genes evolve as reals and are snapped when scored.  An unordered gene takes its value
// from one of the three donors.  When the whole population has become one point, all but the best
// are drawn anew.
#pragma once

#include <array>

#include "master/evolve/methods/search_method.h"

namespace gapfarm {

class DifferentialEvolution final : public SearchMethod {
 public:
  static constexpr unsigned kPopulation = 30;  // of Weitnauer, Haschke and Ritter (2010)
  static constexpr double kWeight = 0.8, kCrossover = 0.9;  // of Storn and Price

  explicit DifferentialEvolution(const MethodSetup& setup);

  std::vector<Genome> propose(const StreamOf& stream_of) const override;
  void learn(std::span<const Genome> proposed, std::span<const Standing> standings) override;
  unsigned origin() const override { return population_.empty() ? kRandom : kDifference; }
  std::vector<NamedNumber> figures() const override;
  bool compares_scores() const override { return true; }
  std::vector<Standing> compared() const override;
  std::span<Individual> incumbents() override { return population_; }
  void save(v1::MethodState& message) const override;
  Status restore(const v1::MethodState& message) override;

  std::size_t iterations() const { return iterations_; }
  bool has_population() const { return !population_.empty(); }
  // REQUIRES: has_population().
  const Individual& best() const;

 private:
  struct Rates {
    double weight = 0.5, crossover = 0.5;
  };

  Rates draw_rates(Stream& stream) const;
  Genome trial_vector(std::size_t target, std::size_t pbest, const Rates& rates,
                      Stream& stream) const;
  void remember(const std::vector<Rates>& of_use);
  bool converged() const;
  bool adapts() const {
    return !setup_.settings.differential_weight && !setup_.settings.crossover_rate;
  }

  MethodSetup setup_;
  std::size_t size_;
  std::size_t iterations_ = 0;
  std::vector<Individual> population_;  // empty: to be drawn
  Genome keep_;                         // of the next draw; empty: none
  std::vector<Genome> archive_;         // parents that lost to a child, oldest first
  std::array<Rates, 6> memory_;
  std::uint64_t remembered_ = 0;      // times; says which row of the memory is next
  mutable std::vector<Rates> drawn_;  // of the last proposals
};

}  // namespace gapfarm
