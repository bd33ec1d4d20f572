// What one search does with ranks alone: the part of an optimiser that knows a method's name.
//
// A method proposes points and learns how they stand.  Counting, naming, scoring again under noise,
// recognising what was scored before and remembering the best are make_search()'s.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/config/settings.h"
#include "gapfarm/v1/record.pb.h"
#include "master/evolve/individual.h"
#include "master/evolve/optimiser.h"

namespace gapfarm {

struct MethodSetup {
  OptimiserSettings settings;
  unsigned population = 40;  // when the settings leave it to the evolution
  GeneSpace space;
  Genome start;                // where to begin; empty: anywhere
  std::vector<double> spread;  // of the start, a covariance row by row; empty: unknown
  bool noisy = false;          // scores differ between replicates
  std::uint64_t evaluations = ~std::uint64_t{0};  // when the run ends
  std::vector<Genome> given = {};  // members of the first population beside the start
};

// The stream of a generation's k-th proposal.
using StreamOf = std::function<Stream(std::size_t)>;

class SearchMethod {
 public:
  virtual ~SearchMethod() = default;

  // Points to score next, at least one.  They may leave [0, 1] and lie between levels: what is
  // scored is placed() of them, and learn() gets them back as they are.
  virtual std::vector<Genome> propose(const StreamOf& stream_of) const = 0;
  virtual void learn(std::span<const Genome> proposed, std::span<const Standing> standings) = 0;

  // What others had, a generation of each, best first: for the next learn().
  virtual void meet(std::span<const std::vector<Individual>>) {}
  // What a genome from elsewhere, among the proposals, is learned as.
  virtual Genome taken(const Genome& migrant) const { return migrant; }

  virtual unsigned origin() const = 0;  // of the next proposals
  // A generation lasts until so many points were proposed: one point alone is none.
  virtual std::size_t generation_size() const { return 1; }
  // For the run store's table of operators: step sizes, phases.
  virtual std::vector<NamedNumber> figures() const { return {}; }
  virtual std::string reason() const { return {}; }  // as Optimiser::reason()

  // Of a method that compares scores one by one, so that under noise it needs more than one each:
  virtual bool compares_scores() const { return false; }
  // what the next proposals are compared with, and where proposal k is compared with the k-th of
  // these alone, they themselves.
  virtual std::vector<Standing> compared() const { return {}; }
  virtual std::span<Individual> incumbents() { return {}; }
  // What is compared differs by no more than noise: a search that refines has converged.
  virtual void settle() {}

  virtual void save(v1::MethodState& message) const = 0;
  // Error: the message is not one that save() made for this setup.
  virtual Status restore(const v1::MethodState& message) = 0;
};

// The optimiser that asks for what `method` proposes; `kind`: its name in configs.
std::unique_ptr<Optimiser> make_search(std::string kind, const OptimiserSetup& setup,
                                       std::unique_ptr<SearchMethod> method);

// Into [0, 1] as if mirrors stood at both ends.
inline double mirrored(double gene) { return std::abs(std::remainder(gene, 2)); }

// Mirrored gene by gene, then snapped.  A function seen through it has no bounds and no jump at
// them.
Genome placed(const GeneSpace& space, const Genome& proposed);

// The error of restore().
Error damaged_method_state(const std::string& method);

// In a method's source: how the table of methods makes it.
#define GAPFARM_METHOD(Class)                                                   \
  std::unique_ptr<SearchMethod> make_method_##Class(const MethodSetup& setup) { \
    return std::make_unique<Class>(setup);                                      \
  }
// Of every row of methods.inc.
#define METHOD(name, file, Class, summary) \
  std::unique_ptr<SearchMethod> make_method_##Class(const MethodSetup& setup);
#include "common/config/methods.inc"

}  // namespace gapfarm
