// The hybrid of Weitnauer, Haschke and Ritter (2010): some iterations of differential evolution,
// then a simplex from the best.  When the simplex has converged, all of it begins again.
#include <algorithm>

#include "master/evolve/methods/differential_evolution.h"
#include "master/evolve/methods/local_search.h"

namespace gapfarm {
namespace {

class DeSimplex final : public SearchMethod {
 public:
  explicit DeSimplex(MethodSetup setup)
      : setup_(with_fixed_rates(std::move(setup))),
        differential_(setup_),
        simplex_(setup_, false) {}

  std::vector<Genome> propose(const StreamOf& stream_of) const override {
    return current().propose(stream_of);
  }

  void learn(std::span<const Genome> proposed, std::span<const Standing> standings) override {
    if (polishing_) {
      simplex_.learn(proposed, standings);
      if (!simplex_.converged()) return;
      ++rounds_;
      polishing_ = false;
      MethodSetup anew = setup_;
      anew.start.clear();
      differential_ = DifferentialEvolution(anew);
      return;
    }
    // The iteration that ends differential evolution may be one that starts it over with nobody.
    const auto least = std::ranges::min_element(standings, better);
    Individual best;
    best.genome = proposed[static_cast<std::size_t>(least - standings.begin())];
    best.standing = *least;
    differential_.learn(proposed, standings);
    if (differential_.iterations() < setup_.settings.iterations) return;
    if (differential_.has_population()) best = differential_.best();
    simplex_.begin(best.genome, best.standing);
    polishing_ = true;
  }

  unsigned origin() const override { return current().origin(); }

  std::vector<NamedNumber> figures() const override {
    return {{"simplex", polishing_ ? 1.0 : 0.0}, {"rounds", static_cast<double>(rounds_)}};
  }

  bool compares_scores() const override { return true; }
  std::vector<Standing> compared() const override { return current().compared(); }
  void settle() override {
    if (polishing_) simplex_.settle();
  }
  std::span<Individual> incumbents() override {
    return polishing_ ? simplex_.incumbents() : differential_.incumbents();
  }

  void save(v1::MethodState& message) const override {
    v1::DeSimplexState& state = *message.mutable_de_simplex();
    SAVE_STATE(polishing, rounds)
    differential_.save(*state.mutable_differential());
    simplex_.save(*state.mutable_simplex());
  }

  Status restore(const v1::MethodState& message) override {
    const v1::DeSimplexState& state = message.de_simplex();
    LOAD_STATE(polishing, rounds)
    RETURN_IF_ERROR(differential_.restore(state.differential()));
    return simplex_.restore(state.simplex());
  }

 private:
  // As the hybrid was described: differential evolution does not adapt itself.
  static MethodSetup with_fixed_rates(MethodSetup setup) {
    std::optional<double>& weight = setup.settings.differential_weight;
    if (!weight) weight = DifferentialEvolution::kWeight;
    return setup;
  }

  const SearchMethod& current() const {
    if (polishing_) return simplex_;
    return differential_;
  }

  MethodSetup setup_;
  bool polishing_ = false;
  std::uint64_t rounds_ = 0;
  DifferentialEvolution differential_;
  LocalSearch simplex_;
};

}  // namespace

GAPFARM_METHOD(DeSimplex)

}  // namespace gapfarm
