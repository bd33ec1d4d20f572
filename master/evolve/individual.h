// Which of two individuals is the better, how they are saved, and what optimisers of them share.
#pragma once

#include <cstdint>
#include <nlohmann/detail/macro_scope.hpp>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/base/result.h"
#include "common/parameters/table.h"
#include "common/random/stream.h"
#include "gapfarm/v1/record.pb.h"
#include "master/evolve/optimiser.h"

namespace gapfarm {

enum class GeneShape {
  kReal,       // any value in [0, 1]
  kOrdered,    // integers: `levels` equal shares, neighbours are alike
  kUnordered,  // booleans and choices: `levels` equal shares, no neighbours
};

struct GeneKind {
  GeneShape shape = GeneShape::kReal;
  std::size_t levels = 0;  // of ordered and unordered genes, at least 1; 0: real
};

// Genomes leave every function below snapped: a gene with levels sits in the middle of its share,
// (k + 1/2) / levels, so equal decoded values are equal genes, bit for bit.
class GeneSpace {
 public:
  // A gene whose range is one value has one level.
  GeneSpace(const ParameterTable& table, const std::vector<Gene>& genes);
  explicit GeneSpace(std::vector<GeneKind> kinds) : kinds_(std::move(kinds)) {}

  std::size_t size() const { return kinds_.size(); }
  const GeneKind& operator[](std::size_t gene) const { return kinds_[gene]; }

  // Nearest member of the space: clamped to [0, 1], levels snapped.
  double snapped(std::size_t gene, double g) const;
  Genome snapped(Genome genome) const;

  // Uniform over the gene's values.
  double random(std::size_t gene, Stream& stream) const;
  Genome random(Stream& stream) const;

  // A Gaussian step of s.d. `sigma` (share of the range), reflected at the ends.  An ordered gene
  // moves by at least one level; an unordered one goes to another level, each equally likely.
  double stepped(std::size_t gene, double g, double sigma, Stream& stream) const;

  // BLX-alpha of one gene (Eshelman and Schaffer 1993): uniform on the parents' interval widened by
  // `alpha` of its width on both sides, cut off at 0 and 1.  Unordered genes come from a parent.
  double blended(std::size_t gene, double a, double b, double alpha, Stream& stream) const;

 private:
  std::size_t level(std::size_t gene, double g) const;
  double middle(std::size_t gene, std::size_t level) const;

  std::vector<GeneKind> kinds_;
};

// Bits of Individual::origin.
enum Origin : unsigned {
  kOnePoint = 1u << 0,
  kUniform = 1u << 1,
  kBlend = 1u << 2,
  kGaussian = 1u << 3,
  kUniformReset = 1u << 4,
  kElite = 1u << 5,
  kRandom = 1u << 6,
  kNominal = 1u << 7,
  kDifference = 1u << 8,        // a trial vector of differential evolution
  kSampled = 1u << 9,           // from CMA-ES's distribution
  kLocal = 1u << 10,            // a step of a local search
  kMigrant = 1u << 11,          // the best of another island
  kSimulatedBinary = 1u << 12,  // crossover of NSGA-II
  kPolynomial = 1u << 13,       // mutation of NSGA-II
  kGiven = 1u << 14,            // begun with (SearchStart)
};
std::string origin_name(unsigned origin);  // "blend+gaussian"
// Whether operator_probabilities() states by this name how often one is drawn, or that none is;
// figures of other searches stand beside them.
bool is_operator(const std::string& name);

// OK by cost, then INFEASIBLE by cost, then the other outcomes in the enum's order, unspecified
// last. A strict weak order: no NaN gets here.
bool better(const Standing& a, const Standing& b);

bool better_individual(const Individual& a, const Individual& b);  // by their standings

// Best first; equal standings in order of birth, which makes the order total.
void sort_best_first(std::vector<Individual>& individuals);

// Mean distance of the genes from their mean over the individuals, in [0, 1]; 0 for none.
double diversity_of(const std::vector<Individual>& individuals);

// Genomes scored of late, so that a duplicate costs nothing.  Keyed by 64 bits of a hash of the
// genome's bits: of 16,000 genomes two differ in less than that with a chance of 1e-11.
class SeenGenomes {
 public:
  // The last so many genomes are kept, which bounds the optimiser's state: every generation's is
  // stored.
  explicit SeenGenomes(std::size_t limit) : limit_(limit) {}

  static std::uint64_t key(const Genome& genome);

  const Standing* find(const Genome& genome) const;
  void remember(const Genome& genome, const Standing& standing);
  // Forgets the oldest beyond the limit.
  void trim();

  std::size_t size() const { return order_.size(); }
  const std::vector<std::uint64_t>& order() const { return order_; }  // oldest first
  const Standing& at(std::uint64_t key) const { return standings_.at(key); }
  void restore(std::uint64_t key, const Standing& standing);

 private:
  std::size_t limit_;
  std::vector<std::uint64_t> order_;
  std::unordered_map<std::uint64_t, Standing> standings_;
};

// Error: `state` is no message of this type.
template <class Message>
Result<Message> parse_state(std::string_view state) {
  Message message;
  if (message.ParseFromArray(state.data(), static_cast<int>(state.size()))) return message;
  return Error{"the saved optimiser state is damaged: it cannot be decoded"};
}

// Members `name_` of an optimiser in its message `state`.
#define SAVE_STATE_(name) state.set_##name(name##_);
#define LOAD_STATE_(name) name##_ = state.name();
#define SAVE_STATE(...) NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(SAVE_STATE_, __VA_ARGS__))
#define LOAD_STATE(...) NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(LOAD_STATE_, __VA_ARGS__))

// Individuals and seen genomes in a saved optimiser state.
void save(const Individual& individual, v1::Individual& message);
// Errors: another number of genes than the space's, a gene outside [0, 1], a cost that is not
// finite.
Result<Individual> load(const v1::Individual& message, const GeneSpace& space);

// `with_spread`: genomes may have been scored more than once.
void save_seen(const SeenGenomes& seen, bool with_spread, v1::GeneticState& message);
// Error: the lists of the message differ in length.
Status load_seen(const v1::GeneticState& message, SeenGenomes& seen);

// What optimisers of individuals count, keep and save alike.
class CountingOptimiser : public Optimiser {
 public:
  std::uint64_t generation() const override { return generation_; }
  std::uint64_t evaluations() const override { return evaluations_; }
  std::uint64_t last_improvement() const override { return last_improvement_; }
  const Individual& best() const override { return best_; }
  std::vector<Individual> members() const override;  // the best, and what else the population has
  double diversity() const override { return diversity_of(population_); }

 protected:
  explicit CountingOptimiser(const OptimiserSetup& setup);

  // Of a child of the next generation.
  Stream stream_of(std::uint64_t birth_id) const;
  // Under noise a full set of scores outranks any lower cost.
  bool preferred(const Standing& a, const Standing& b) const;
  // Whom of the population the title goes to, in this generation.
  void update_best(std::uint64_t generation);
  // Everything below that changes; `with_best`: the best is no other than who is preferred.
  void save_counts(bool with_best, v1::GeneticState& state) const;
  // Error: the message is not one that save_counts() made for this setup.
  Status restore_counts(bool with_best, const v1::GeneticState& state);

  GeneSpace space_;
  std::uint64_t run_seed_;
  bool noisy_;
  unsigned full_scores_;  // of an individual that may be the best
  std::uint64_t births_apart_;

  std::uint64_t generation_ = 0;
  std::uint64_t next_birth_id_;
  std::uint64_t evaluations_ = 0;
  std::uint64_t last_improvement_ = 0;
  std::vector<Individual> population_;  // best first
  Individual best_;
  SeenGenomes seen_;
};

}  // namespace gapfarm
