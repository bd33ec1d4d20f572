// Ask/tell optimisers over genes in [0, 1].  Nobody else knows how they work.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"
#include "common/parameters/table.h"
#include "gapfarm/v1/task.pb.h"

namespace gapfarm {

// One evaluation that the optimiser wants.  (birth_id, replicate) name its random stream.
struct Candidate {
  std::uint64_t birth_id = 0;
  std::uint64_t replicate = 0;
  Genome genome;
};

// The answer to a candidate.  `cost` is lower-is-better and meaningful only when `outcome` is OK,
// and where it is INFEASIBLE, which ranks behind every OK: by how much constraints are violated
// (Deb 2000).  Any other outcome ranks behind these, in the enum's order.
struct Score {
  v1::Outcome outcome = v1::OUTCOME_UNSPECIFIED;
  double cost = 0;
  std::vector<double> costs = {};  // one each of several objectives, lower is better
};

// What is known of a genome's cost.
struct Standing {
  v1::Outcome outcome = v1::OUTCOME_UNSPECIFIED;  // the worst of its scores
  double cost = 0;                                // mean over OK scores; INFEASIBLE: the greatest
  double m2 = 0;                                  // sum of their squared deviations
  unsigned scores = 0;
  std::vector<double> costs = {};  // of several objectives, means as `cost`

  // Takes one more score.  One with a cost that is not finite counts as DIVERGED.
  void add(const Score& score);
};

struct Individual {
  std::uint64_t birth_id = 0;
  Genome genome;
  Standing standing;
  std::vector<std::uint64_t> parents;
  unsigned origin = 0;  // bits of Origin (individual.h)
};

struct NamedNumber {
  std::string name;
  double value = 0;
};

// The islands of an Optimiser; for who drives them one by one instead of by ask() and tell().
// Meanwhile the Optimiser itself shows the last generation that advance() has reached.
class Islands {
 public:
  virtual ~Islands() = default;

  // What an island asks for, a generation of it.
  struct Lot {
    std::size_t island = 0;
    std::vector<Candidate> candidates;  // at least one
  };
  // Begins a generation, none after `last`, on every island that has none under way and needs
  // nothing that others do not have yet.
  virtual std::vector<Lot> begin(std::uint64_t last) = 0;
  // Scores in the order of the island's lot; completes its generation.
  virtual void tell_island(std::size_t island, std::span<const Score> scores) = 0;
  // The Optimiser goes on to its next generation.  False: some island has not completed it.
  virtual bool advance() = 0;
  // Births of a generation, of all islands.
  virtual std::uint64_t population() const = 0;
};

class Optimiser {
 public:
  virtual ~Optimiser() = default;

  // The next generation's evaluations; may be empty when every child is a duplicate.
  virtual std::vector<Candidate> ask() = 0;
  // Scores in the order of the last ask().  Completes the generation, unless generation() stays.
  virtual void tell(std::span<const Score> scores) = 0;

  // What others had, a generation of each, best first: for the next generation.
  // REQUIRES: generation() > 0, and every ask() has had its tell().
  virtual void meet(std::span<const std::vector<Individual>>) {}
  // Where parts of the search need not wait for one another; null: there are none.
  virtual Islands* islands() { return nullptr; }

  virtual std::uint64_t generation() const = 0;         // completed generations
  virtual std::uint64_t evaluations() const = 0;        // scores given since the start
  virtual std::uint64_t last_improvement() const = 0;   // generation
  virtual std::vector<Individual> members() const = 0;  // best first
  virtual const Individual& best() const = 0;           // REQUIRES: generation() > 0
  // Mean distance of the members' genes from their mean, in [0, 1].
  virtual double diversity() const = 0;
  virtual std::vector<NamedNumber> operator_probabilities() const = 0;
  // For the log: what searches and why, where the optimiser chose it; else empty.
  virtual std::string reason() const { return {}; }

  // Everything ask() and tell() depend on; restoring it continues bit for bit.
  // REQUIRES: every ask() has had its tell(), and the generation is complete.
  virtual std::string state() const = 0;
  // Goes on where the optimiser was whose state() gave `state`.  Settings may differ from its (a
  // larger population, say), genes and operators may not.  Error: the state is damaged, or of
  // another kind, other genes or operators.  REQUIRES: nothing was asked.
  virtual Status restore(std::string_view state) = 0;
};

// What every optimiser is made from.
struct OptimiserSetup {
  EvolutionSettings settings;             // such as a config may have
  const ParameterTable* table = nullptr;  // outlives the optimiser
  std::vector<Gene> genes;
  Genome nominal;  // of the config's own values; empty: unknown
  // How unsure that genome is: a covariance in gene units, row by row; empty: unknown.
  std::vector<double> spread;
  std::uint64_t run_seed = 0;
  bool noisy = false;  // scores differ between replicates (SpreadKind::kSampled)
  // Members of the first generation beside the nominal one, best first.
  std::vector<Genome> given = {};
  // Birth ids: the first, and how far the next is from one.
  std::uint64_t first_birth = 0, births_apart = 1;
};

}  // namespace gapfarm
