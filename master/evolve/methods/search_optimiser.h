// An Optimiser around a SearchMethod.
//
// Randomness: proposal k of generation g draws from Stream{run_seed, kEvolution, g, birth_id, 0}
// with its own birth id.  A genome that was scored before is not scored again.
//
// Noise: the best so far and the best of the last generation are scored until they have
// `elite_replicates` scores; only then can one take the title.  The method itself learns from the
// first scores.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "master/evolve/methods/search_method.h"
#include "master/evolve/optimiser.h"

namespace gapfarm {

class SearchOptimiser final : public Optimiser {
 public:
  SearchOptimiser(std::string kind, const OptimiserSetup& setup,
                  std::unique_ptr<SearchMethod> method);

  std::vector<Candidate> ask() override;
  void tell(std::span<const Score> scores) override;
  void inject(const Genome& genome) override { migrant_ = genome; }

  std::uint64_t generation() const override { return generation_; }
  std::uint64_t evaluations() const override { return evaluations_; }
  std::uint64_t last_improvement() const override { return last_improvement_; }
  std::vector<Member> members() const override;  // the generation's proposals and the best
  const Member& best() const override;
  double diversity() const override { return diversity_of(round_); }
  std::vector<NamedNumber> operator_probabilities() const override { return method_->figures(); }
  std::string reason() const override { return method_->reason(); }
  std::string state() const override;

  // Errors: a state of another kind or of other genes, or damaged.
  Status restore(std::string_view state);

 private:
  struct Plan {
    std::vector<Individual> rescored;
    std::vector<Genome> proposed;
    std::vector<Individual> individuals;  // one a proposal
    std::vector<bool> asked;              // one a proposal
    std::vector<Candidate> candidates;
  };

  Plan plan_generation() const;
  void add_rescored(Plan& plan) const;
  unsigned full_scores() const;
  bool preferred(const Standing& a, const Standing& b) const;
  void update_best();

  std::string kind_;
  GeneSpace space_;
  std::uint64_t run_seed_;
  bool noisy_;
  unsigned elite_replicates_;
  std::unique_ptr<SearchMethod> method_;

  std::uint64_t generation_ = 0;
  std::uint64_t next_birth_id_ = 0;
  std::uint64_t evaluations_ = 0;
  std::uint64_t last_improvement_ = 0;
  std::vector<Individual> round_;  // the last generation's, best first
  Individual best_;
  Member best_member_;
  SeenGenomes seen_;
  Genome migrant_;            // of the next generation; empty: none
  std::optional<Plan> plan_;  // asked for, without scores yet
};

}  // namespace gapfarm
