#include <cassert>

#include "gapfarm/v1/record.pb.h"
#include "master/evolve/individual.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {
namespace {

// The setup over the genes of one stage, which begins at those of `base`.
OptimiserSetup part_of(const OptimiserSetup& whole, const Stage& stage, const Genome& base) {
  OptimiserSetup part = whole;
  part.genes.clear();
  part.nominal.clear();
  part.spread.clear();
  part.given.clear();
  for (const std::size_t gene : stage.genes) {
    part.genes.push_back(whole.genes[gene]);
    part.nominal.push_back(base[gene]);
  }
  return part;
}

class StagedOptimiser final : public Optimiser {
 public:
  StagedOptimiser(const OptimiserSetup& setup, std::vector<Stage> stages)
      : setup_(setup), stages_(std::move(stages)) {}

  Status begin() {
    ASSIGN_OR_RETURN(inner_, make_optimiser(stage_setup()));
    return {};
  }

  Status restore(std::string_view bytes) override {
    v1::StagedState state;
    const std::size_t genes = setup_.genes.size();
    if (!state.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())) ||
        state.stage() >= stages_.size() || !state.has_best() ||
        static_cast<std::size_t>(state.base_size()) != state.stage() * genes) {
      return Error{
          "the saved state of the stages is damaged or belongs to other stages or another "
          "version; resume with the config and the build of the run"};
    }
    LOAD_STATE(stage, generations, evaluations, births, last_improvement)
    results_ = stage_results(bytes, genes);
    RETURN_IF_ERROR(begin());
    RETURN_IF_ERROR(inner_->restore(state.optimiser()));
    if (stage_ > 0) {
      const v1::Individual& best = state.best();
      const auto outcome = static_cast<v1::Outcome>(best.outcome());
      kept_best_ = {best.birth_id(),
                    results_.back(),
                    {outcome, best.fitness(), 0, best.scores()},
                    {},
                    kElite};
    }
    if (generation() > 0) update_best();
    return {};
  }

  std::vector<Candidate> ask() override {
    std::vector<Candidate> candidates = inner_->ask();
    for (Candidate& candidate : candidates) {
      candidate.birth_id += births_;
      candidate.genome = completed(candidate.genome);
    }
    return candidates;
  }

  void tell(std::span<const Score> scores) override {
    const std::uint64_t was = inner_->generation();
    const bool first = generation() == 0;
    const Individual before = best_;
    inner_->tell(scores);
    if (inner_->generation() == was) return;
    update_best();
    if (first || better_individual(best_, before)) last_improvement_ = generation();
    const bool over = inner_->evaluations() >= stages_[stage_].evaluations;
    if (stage_ + 1 < stages_.size() && over) advance();
  }

  std::uint64_t generation() const override { return generations_ + inner_->generation(); }
  std::uint64_t evaluations() const override { return evaluations_ + inner_->evaluations(); }
  std::uint64_t last_improvement() const override { return last_improvement_; }
  const Individual& best() const override { return best_; }
  double diversity() const override { return inner_->diversity(); }
  std::string reason() const override { return inner_->reason(); }
  std::vector<NamedNumber> operator_probabilities() const override {
    std::vector<NamedNumber> all = inner_->operator_probabilities();
    all.push_back({"stage", static_cast<double>(stage_ + 1)});
    return all;
  }

  // Of the generation just completed; after a stage's last one, of the stage that ended.
  std::vector<Individual> members() const override {
    if (inner_->generation() == 0) return last_members_;
    std::vector<Individual> members;
    for (const Individual& member : inner_->members()) members.push_back(completed(member));
    if (stage_ > 0 && members.front().birth_id != best_.birth_id) {
      members.insert(members.begin(), best_);
    }
    return members;
  }

  std::string state() const override {
    v1::StagedState state;
    SAVE_STATE(stage, generations, evaluations, births, last_improvement)
    state.set_optimiser(inner_->state());
    for (const Genome& genome : results_) state.mutable_base()->Add(genome.begin(), genome.end());
    v1::Individual* best = state.mutable_best();
    best->set_birth_id(kept_best_.birth_id);
    best->set_outcome(static_cast<std::uint32_t>(kept_best_.standing.outcome));
    best->set_fitness(kept_best_.standing.cost);
    best->set_scores(kept_best_.standing.scores);
    return state.SerializeAsString();
  }

 private:
  const Genome& base() const { return results_.empty() ? setup_.nominal : results_.back(); }

  OptimiserSetup stage_setup() const {
    OptimiserSetup setup = part_of(setup_, stages_[stage_], base());
    // Draws of its own: another stage with as many genes would repeat them.
    setup.run_seed = setup_.run_seed + 0x9e3779b97f4a7c15u * stage_;
    return setup;
  }

  Genome completed(const Genome& part) const {
    Genome genome = base();
    for (std::size_t i = 0; i < part.size(); ++i) genome[stages_[stage_].genes[i]] = part[i];
    return genome;
  }

  Individual completed(Individual member) const {
    member.genome = completed(member.genome);
    member.birth_id += births_;
    for (std::uint64_t& parent : member.parents) parent += births_;
    return member;
  }

  void update_best() {
    if (inner_->generation() == 0) {
      best_ = kept_best_;
      return;
    }
    const Individual found = completed(inner_->best());
    best_ = stage_ > 0 && better_individual(kept_best_, found) ? kept_best_ : found;
  }

  void advance() {
    last_members_ = members();
    generations_ += inner_->generation();
    evaluations_ += inner_->evaluations();
    // Births are counted by the greatest that the stage could have given: one a score and
    // duplicate.
    for (const Individual& member : last_members_) births_ = std::max(births_, member.birth_id + 1);
    kept_best_ = best_;
    kept_best_.origin = kElite;
    results_.push_back(best_.genome);
    ++stage_;
    auto made = make_optimiser(stage_setup());
    assert(made.ok() && "checked when the first stage was made");
    inner_ = *std::move(made);
  }

  OptimiserSetup setup_;
  std::vector<Stage> stages_;
  std::size_t stage_ = 0;
  std::vector<Genome> results_;  // of the completed stages
  std::unique_ptr<Optimiser> inner_;
  std::uint64_t generations_ = 0, evaluations_ = 0, births_ = 0;  // of the completed stages
  std::uint64_t last_improvement_ = 0;
  Individual kept_best_;  // of the completed stages
  Individual best_;
  std::vector<Individual> last_members_;
};

Status check_stages(const OptimiserSetup& setup, const std::vector<Stage>& stages) {
  if (setup.nominal.size() != setup.genes.size()) {
    return Error{"stages need the config's own values to begin with"};
  }
  // Every stage's own setup must be one that an optimiser takes.
  for (const Stage& stage : stages) {
    RETURN_IF_ERROR(make_optimiser(part_of(setup, stage, setup.nominal)));
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<Optimiser>> make_staged(const OptimiserSetup& setup,
                                               const std::vector<Stage>& stages) {
  RETURN_IF_ERROR(check_stages(setup, stages));
  auto optimiser = std::make_unique<StagedOptimiser>(setup, stages);
  RETURN_IF_ERROR(optimiser->begin());
  return std::unique_ptr<Optimiser>(std::move(optimiser));
}

std::vector<Genome> stage_results(std::string_view state, std::size_t genes) {
  v1::StagedState message;
  std::vector<Genome> results;
  if (genes == 0 || !message.ParseFromArray(state.data(), static_cast<int>(state.size())))
    return {};
  for (auto at = message.base().begin(); message.base().end() - at >= static_cast<long>(genes);
       at += static_cast<long>(genes)) {
    results.emplace_back(at, at + static_cast<long>(genes));
  }
  return results;
}

}  // namespace gapfarm
