// Behind genetic.h.  A generation: elites carried over, children bred, all scored, ranked.
#pragma once

#include <optional>

#include "gapfarm/v1/record.pb.h"
#include "master/evolve/genetic/breeder.h"
#include "master/evolve/genetic/genetic.h"

namespace gapfarm {

class GeneticAlgorithm final : public Optimiser {
 public:
  explicit GeneticAlgorithm(const OptimiserSetup& setup);

  std::vector<Candidate> ask() override;
  void tell(std::span<const Score> scores) override;
  void meet(std::span<const std::vector<Individual>> others) override;

  std::uint64_t generation() const override { return generation_; }
  std::uint64_t evaluations() const override { return evaluations_; }
  std::uint64_t last_improvement() const override { return last_improvement_; }
  std::vector<Individual> members() const override;
  const Individual& best() const override { return best_; }
  double diversity() const override { return diversity_of(population_); }
  std::vector<NamedNumber> operator_probabilities() const override {
    return breeder_.probabilities();
  }
  std::string state() const override;
  Status restore(std::string_view state) override;

 private:
  struct Newborn {
    Individual individual;
    std::optional<Standing> parent;  // of the better parent; none for random and nominal ones
    std::vector<Child::Arm> arms;
    bool asked = true;  // false: a genome that was scored before, or asked for a sibling
  };
  struct Plan {
    std::vector<Individual> elites;
    std::vector<Newborn> newborns;
    std::vector<Candidate> candidates;
  };

  Plan plan_generation();
  void add_first_generation(Plan& plan);
  std::uint64_t next_birth();
  void add_random(Plan& plan);
  void add_children(Plan& plan);
  void add_candidates(Plan& plan) const;
  std::vector<Individual> choose_elites() const;
  Stream stream_of(std::uint64_t birth_id) const;
  bool restart_due() const;
  bool fully_scored(const Standing& standing) const;
  unsigned full_scores() const;

  void take_scores(Plan& plan, std::span<const Score> scores);
  void learn(const Plan& plan);
  void update_best();

  EvolutionSettings settings_;
  Breeder breeder_;
  Genome nominal_;
  std::vector<Genome> given_;
  std::uint64_t run_seed_;
  bool noisy_;

  std::uint64_t generation_ = 0;
  std::uint64_t next_birth_id_;
  std::uint64_t births_apart_;
  std::uint64_t evaluations_ = 0;
  std::uint64_t last_improvement_ = 0;
  std::uint64_t last_restart_ = 0;
  std::uint64_t restarts_ = 0;
  std::vector<Individual> population_;  // best first
  Individual best_;
  SeenGenomes seen_;
  std::vector<Individual> others_;  // parents of the next generation, beside the population
  std::optional<Plan> plan_;        // asked for, without scores yet
};

}  // namespace gapfarm
