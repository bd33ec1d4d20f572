#include "master/evolve/methods/auto_search.h"

#include <algorithm>

#include "master/evolve/methods/cma_es.h"
#include "master/evolve/methods/differential_evolution.h"

namespace gapfarm {
namespace {

// Read off docs/evidence/optimisers.md: where BOBYQA has not arrived after so many evaluations a
// gene, CMA-ES gets there sooner.
constexpr std::size_t kDescent_perGene = 40;
// Not measured beyond.
constexpr std::size_t kMostGenesOfDescent = 40;

bool has(const GeneSpace& space, GeneShape shape) {
  for (std::size_t gene = 0; gene < space.size(); ++gene) {
    if (space[gene].shape == shape) return true;
  }
  return false;
}

MethodSetup for_descent(MethodSetup setup) {
  OptimiserSettings& settings = setup.settings;
  const std::size_t n = setup.space.size();
  settings.local = LocalSearchKind::kBobyqa;
  if (!settings.population) settings.population = CmaEs::default_population(n);
  unsigned& limit = settings.local_evaluations;
  if (limit == 0) limit = static_cast<unsigned>(kDescent_perGene * n);
  return setup;
}

}  // namespace

AutoSearch::AutoSearch(const MethodSetup& setup)
    : setup_(setup), probe_(for_descent(setup)), descent_(for_descent(setup), false) {
  const std::size_t n = setup.space.size();
  const std::string genes = std::to_string(n) + " genes";
  const unsigned limit = for_descent(setup).settings.local_evaluations;
  // A generation to begin with, 2 n + 1 points, and some that use what these show.
  const bool too_short = setup.evaluations && *setup.evaluations < 4 * n + 10;
  if (setup.noisy) {
    reason_ = "CMA-ES, because scores are noisy";
  } else if (has(setup.space, GeneShape::kUnordered)) {
    reason_ = "differential evolution, because values of some genes have no order";
  } else if (has(setup.space, GeneShape::kOrdered)) {
    reason_ = "CMA-ES, because some genes are integers";
  } else if (!setup.spread.empty()) {
    reason_ = "CMA-ES, because it is known how far from the start to look";
  } else if (n > kMostGenesOfDescent) {
    reason_ = "CMA-ES, because " + genes + " are too many for BOBYQA";
  } else if (too_short) {
    reason_ = "CMA-ES, because the evaluations are too few for BOBYQA's model of " + genes;
  } else {
    reason_ = "BOBYQA, at most " + std::to_string(limit) + " evaluations one at a time, because " +
              "all genes are real and scores free of noise; then CMA-ES";
    phase_ = kProbing;
  }
  reason_ = "kind = \"auto\": searches by " + reason_;
  begin_global();
}

void AutoSearch::begin_global() {
  if (!setup_.noisy && has(setup_.space, GeneShape::kUnordered)) {
    global_ = std::make_unique<DifferentialEvolution>(setup_);
  } else {
    global_ = std::make_unique<CmaEs>(setup_);
  }
}

const SearchMethod& AutoSearch::current() const {
  if (phase_ == kProbing) return probe_;
  if (phase_ == kDescending) return descent_;
  return *global_;
}

std::vector<Genome> AutoSearch::propose(const StreamOf& stream_of) const {
  return current().propose(stream_of);
}

void AutoSearch::learn(std::span<const Genome> proposed, std::span<const Standing> standings) {
  if (phase_ == kGlobal) {
    global_->learn(proposed, standings);
  } else if (phase_ == kProbing) {
    const auto least = std::min_element(standings.begin(), standings.end(), better);
    descent_.begin(proposed[static_cast<std::size_t>(least - standings.begin())], *least);
    phase_ = kDescending;
  } else {
    descent_.learn(proposed, standings);
    if (!descent_.converged()) return;
    phase_ = kGlobal;
    setup_.start = descent_.best();
    setup_.spread.clear();
    begin_global();
  }
}

std::vector<NamedNumber> AutoSearch::figures() const {
  std::vector<NamedNumber> figures = {{"phase", static_cast<double>(phase_)}};
  for (NamedNumber& figure : current().figures()) figures.push_back(std::move(figure));
  return figures;
}

void AutoSearch::save(v1::MethodState& message) const {
  v1::AutoSearchState& state = *message.mutable_auto_search();
  state.set_phase(phase_);
  state.mutable_start()->Add(setup_.start.begin(), setup_.start.end());
  if (phase_ != kProbing) current().save(*state.mutable_method());
}

Status AutoSearch::restore(const v1::MethodState& message) {
  const v1::AutoSearchState& state = message.auto_search();
  const auto genes = static_cast<std::size_t>(state.start_size());
  if (!message.has_auto_search() || state.phase() > kGlobal ||
      (genes != 0 && genes != setup_.space.size())) {
    return damaged_method_state("auto");
  }
  phase_ = static_cast<Phase>(state.phase());
  if (phase_ == kProbing) return {};
  if (phase_ == kDescending) return descent_.restore(state.method());
  setup_.start.assign(state.start().begin(), state.start().end());
  begin_global();
  return global_->restore(state.method());
}

GAPFARM_METHOD(AutoSearch)

}  // namespace gapfarm
