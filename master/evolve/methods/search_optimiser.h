// An Optimiser around a SearchMethod.
//
// Randomness: proposal k of generation g draws from Stream{run_seed, kEvolution, g, birth_id, 0}
// with its own birth id.  A genome that was scored before is not scored again.
//
// Noise: the best so far and the best of the last generation are scored until they have
// `elite_replicates` scores; only then can one take the title.  CMA-ES, which learns from many
// ranks, learns from first scores.  For methods that compare score with score the noise is
// estimated from what was scored more than once, pooled:
// - What proposals are compared with is scored again, once a generation, until the variance of its
//   mean is a quarter of the variance between such means, or it has `elite_replicates` scores.
// - A proposal that looks better than its incumbent is scored again, until it does not, until the
//   difference exceeds two of its standard errors, or it has as many scores: a race.
// - Where there is no incumbent, a proposal gets as many scores at once.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "master/evolve/methods/search_method.h"
#include "master/evolve/optimiser.h"

namespace gapfarm {

class SearchOptimiser final : public CountingOptimiser {
 public:
  SearchOptimiser(std::string kind, const OptimiserSetup& setup,
                  std::unique_ptr<SearchMethod> method);

  std::vector<Candidate> ask() override;
  void tell(std::span<const Score> scores) override;
  void meet(std::span<const std::vector<Individual>> others) override;

  const Individual& best() const override { return complete_best_; }
  std::vector<NamedNumber> operator_probabilities() const override;
  std::string reason() const override;
  std::string state() const override;
  Status restore(std::string_view state) override;

 private:
  enum class Whose { kTitle, kProposal, kIncumbent };
  struct Requested {
    Whose whose;
    std::size_t index;
  };
  struct Plan {
    std::vector<Individual> rescored;
    std::vector<Genome> proposed;
    std::vector<Individual> individuals;  // one a proposal
    std::vector<bool> asked;              // one a proposal
    std::vector<Candidate> candidates;
    std::vector<Requested> requested;  // one a candidate
  };

  Plan plan_generation() const;
  void add_rescored(Plan& plan) const;
  void request(Plan& plan, Requested whom, unsigned scores) const;
  Individual& individual_of(Plan& plan, Requested whom) const;
  void add_scores(Plan& plan, std::span<const Score> scores);
  void race(Plan& plan) const;
  bool replicates() const { return noisy_ && method_->compares_scores(); }
  double noise_variance() const;
  struct Spread {
    double count = 0, variance = 0, of_noise = 0;  // the variance of means, and noise's part of it
  };
  Spread spread_of_compared() const;
  unsigned wanted_scores() const;

  std::string kind_;
  std::unique_ptr<SearchMethod> method_;

  // The population is the last generation's proposals, or this one's so far.
  std::size_t proposed_ = 0;  // of a generation that is not complete
  Individual complete_best_;  // of the generations that are complete
  Genome migrant_;            // of the next generation; empty: none
  std::optional<Plan> plan_;  // asked for, without scores yet
};

}  // namespace gapfarm
