#include "master/evolve/methods/de_simplex.h"

#include <algorithm>

#include "common/base/try.h"

namespace gapfarm {

// As the hybrid was described: differential evolution does not adapt itself.
MethodSetup DeSimplex::with_fixed_rates(MethodSetup setup) {
  std::optional<double>& weight = setup.settings.differential_weight;
  if (!weight) weight = DifferentialEvolution::kWeight;
  return setup;
}

const SearchMethod& DeSimplex::current() const {
  if (polishing_) return simplex_;
  return differential_;
}

std::vector<Genome> DeSimplex::propose(const StreamOf& stream_of) const {
  return current().propose(stream_of);
}

void DeSimplex::learn(std::span<const Genome> proposed, std::span<const Standing> standings) {
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

std::vector<NamedNumber> DeSimplex::figures() const {
  return {{"simplex", polishing_ ? 1.0 : 0.0}, {"rounds", static_cast<double>(rounds_)}};
}

void DeSimplex::save(v1::MethodState& message) const {
  v1::DeSimplexState& state = *message.mutable_de_simplex();
  state.set_polishing(polishing_);
  state.set_rounds(rounds_);
  differential_.save(*state.mutable_differential());
  simplex_.save(*state.mutable_simplex());
}

Status DeSimplex::restore(const v1::MethodState& message) {
  const v1::DeSimplexState& state = message.de_simplex();
  polishing_ = state.polishing();
  rounds_ = state.rounds();
  RETURN_IF_ERROR(differential_.restore(state.differential()));
  return simplex_.restore(state.simplex());
}

GAPFARM_METHOD(DeSimplex)

}  // namespace gapfarm
