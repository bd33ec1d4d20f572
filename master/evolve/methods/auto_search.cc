// Chooses what searches, and says why.  Where scores are free of noise and all genes are real: a
// generation of random points beside the start, BOBYQA from the best of them for as long as it
// pays, then CMA-ES: from where that ended, or with evaluations enough to find the minimum again,
// from the start, because BOBYQA may have ended in another one.  Else CMA-ES, or differential
// evolution where genes are unordered.
#include <algorithm>

#include "master/evolve/methods/cma_es.h"
#include "master/evolve/methods/differential_evolution.h"
#include "master/evolve/methods/local_search.h"

namespace gapfarm {
namespace {

// Read off docs/evidence/optimisers.md: where BOBYQA has not arrived after so many evaluations a
// gene, CMA-ES gets there sooner.
constexpr std::size_t kDescent_perGene = 40, kRoomyDescent_perGene = 10;
// Of the points after its first model this share is better than all before, or it does not pay.
// Where functions are smooth half of them are; on many small minima, a sixth.  Judged from so many
// on.
constexpr double kLeastShare = 0.3;
constexpr std::size_t kLeastPoints = 6;
// What CMA-ES needs, with some margin, on the same functions.
constexpr std::uint64_t kRoomy_perGene = 500;
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

class AutoSearch final : public SearchMethod {
 public:
  explicit AutoSearch(const MethodSetup& setup)
      : setup_(setup),
        roomy_(setup.evaluations / kRoomy_perGene >= setup.space.size()),
        probe_(make_method_RandomSearch(for_descent(setup))),
        descent_(for_descent(setup), false) {
    const std::size_t n = setup.space.size();
    const std::string genes = std::to_string(n) + " genes";
    // A generation to begin with, 2 n + 1 points, and some that use what these show.
    const bool too_short = setup.evaluations < 4 * n + 10;
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
      reason_ =
          "BOBYQA while it pays, at most " + std::to_string(descent_limit()) +
          " evaluations, because all genes are real and scores free of noise; then by CMA-ES " +
          "from " +
          (roomy_ ? "the start, because there are evaluations enough for both"
                  : "the best, because evaluations are few");
      phase_ = kProbing;
    }
    reason_ = "kind = \"auto\": searches by " + reason_;
    begin_global();
  }

  std::vector<Genome> propose(const StreamOf& stream_of) const override {
    return current().propose(stream_of);
  }

  void learn(std::span<const Genome> proposed, std::span<const Standing> standings) override {
    if (phase_ == kGlobal) {
      global_->learn(proposed, standings);
    } else if (phase_ == kProbing) {
      const auto least = std::ranges::min_element(standings, better);
      descent_.begin(proposed[static_cast<std::size_t>(least - standings.begin())], *least);
      phase_ = kDescending;
    } else {
      descent_.learn(proposed, standings);
      if (!descent_.converged() && pays()) return;
      phase_ = kGlobal;
      if (!roomy_) setup_.start = descent_.best();
      begin_global();
    }
  }

  unsigned origin() const override { return current().origin(); }

  // As many as one of CMA-ES, so that limits in generations mean the same all along.
  std::size_t generation_size() const override {
    return phase_ == kDescending ? *for_descent(setup_).settings.population : 1;
  }

  std::vector<NamedNumber> figures() const override {
    std::vector<NamedNumber> figures = {{"phase", static_cast<double>(phase_)}};
    for (NamedNumber& figure : current().figures()) figures.push_back(std::move(figure));
    return figures;
  }

  std::string reason() const override { return reason_; }

  void save(v1::MethodState& message) const override {
    v1::AutoSearchState& state = *message.mutable_auto_search();
    state.set_phase(phase_);
    state.set_roomy(roomy_);
    state.mutable_start()->Add(setup_.start.begin(), setup_.start.end());
    if (phase_ != kProbing) current().save(*state.mutable_method());
  }

  Status restore(const v1::MethodState& message) override {
    const v1::AutoSearchState& state = message.auto_search();
    const auto genes = static_cast<std::size_t>(state.start_size());
    if (!message.has_auto_search() || state.phase() > kGlobal ||
        (genes != 0 && genes != setup_.space.size())) {
      return damaged_method_state("auto");
    }
    phase_ = static_cast<Phase>(state.phase());
    roomy_ = state.roomy();
    if (phase_ == kProbing) return {};
    if (phase_ == kDescending) return descent_.restore(state.method());
    setup_.start.assign(state.start().begin(), state.start().end());
    begin_global();
    return global_->restore(state.method());
  }

 private:
  enum Phase { kProbing, kDescending, kGlobal };

  const SearchMethod& current() const {
    if (phase_ == kProbing) return *probe_;
    if (phase_ == kDescending) return descent_;
    return *global_;
  }

  void begin_global() {
    // Where one start ends in the worse of few minima, as on Rosenbrock's function, small ones
    // help.
    MethodSetup setup = setup_;
    if (roomy_) setup.settings.restarts = RestartKind::kBipop;
    if (!setup_.noisy && has(setup_.space, GeneShape::kUnordered)) {
      global_ = std::make_unique<DifferentialEvolution>(setup);
    } else {
      global_ = std::make_unique<CmaEs>(setup);
    }
  }

  bool pays() const {
    const std::size_t n = setup_.space.size(), model = 2 * n + 1;
    if (descent_.known() >= descent_limit()) return false;
    if (descent_.known() < model + std::max(kLeastPoints, n)) return true;
    const std::size_t since = descent_.known() - model;
    return static_cast<double>(descent_.improvements(since)) >=
           kLeastShare * static_cast<double>(since);
  }

  std::size_t descent_limit() const {
    const std::size_t given = setup_.settings.local_evaluations;
    return given > 0 ? given
                     : setup_.space.size() * (roomy_ ? kRoomyDescent_perGene : kDescent_perGene);
  }

  MethodSetup setup_;  // of the global search
  bool roomy_;         // evaluations enough for CMA-ES to begin anew
  std::string reason_;
  Phase phase_ = kGlobal;
  std::unique_ptr<SearchMethod> probe_;
  LocalSearch descent_;
  std::unique_ptr<SearchMethod> global_;
};

}  // namespace

GAPFARM_METHOD(AutoSearch)

}  // namespace gapfarm
