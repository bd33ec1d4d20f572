// The hybrid of Weitnauer, Haschke and Ritter (2010): some iterations of differential evolution,
// then a simplex from the best.  When the simplex has converged, all of it begins again.
#pragma once

#include "master/evolve/methods/differential_evolution.h"
#include "master/evolve/methods/local_search.h"

namespace gapfarm {

class DeSimplex final : public SearchMethod {
 public:
  explicit DeSimplex(MethodSetup setup)
      : setup_(with_fixed_rates(std::move(setup))),
        differential_(setup_),
        simplex_(setup_, false) {}

  std::vector<Genome> propose(const StreamOf& stream_of) const override;
  void learn(std::span<const Genome> proposed, std::span<const Standing> standings) override;
  unsigned origin() const override { return current().origin(); }
  std::vector<NamedNumber> figures() const override;
  bool compares_scores() const override { return true; }
  std::vector<Standing> compared() const override { return current().compared(); }
  void settle() override {
    if (polishing_) simplex_.settle();
  }
  std::span<Individual> incumbents() override {
    return polishing_ ? simplex_.incumbents() : differential_.incumbents();
  }
  void save(v1::MethodState& message) const override;
  Status restore(const v1::MethodState& message) override;

 private:
  static MethodSetup with_fixed_rates(MethodSetup setup);
  const SearchMethod& current() const;

  MethodSetup setup_;
  bool polishing_ = false;
  std::uint64_t rounds_ = 0;
  DifferentialEvolution differential_;
  LocalSearch simplex_;
};

}  // namespace gapfarm
