// A local search within bounds by NLopt, turned inside out: NLopt calls a function, the farm wants
// to be asked: for one point at a time, but for BOBYQA's first 2 n, which follow from the start.
//
// NLopt's local algorithms are deterministic, so what one asks for next follows from the costs so
// far.  The algorithm runs in a thread of its own, which waits for a cost whenever it needs one,
// and a search that is resumed gives it those that are known.  The costs are all there is to save,
// and a resumed search cannot differ.
//
// Only real genes move; the others keep the start's levels, unless there are no reals.
#pragma once

#include <nlopt.hpp>

#include "master/evolve/methods/search_method.h"

namespace gapfarm {

class LocalSearch final : public SearchMethod {
 public:
  // `restarts`: begin again at a random point when a search has converged; without, propose() asks
  // for its last best point from then on.
  explicit LocalSearch(const MethodSetup& setup, bool restarts = true);
  ~LocalSearch() override;

  std::vector<Genome> propose(const StreamOf& stream_of) const override;
  void learn(std::span<const Genome> proposed, std::span<const Standing> standings) override;
  unsigned origin() const override { return kLocal; }
  std::vector<NamedNumber> figures() const override;
  bool compares_scores() const override { return true; }
  std::vector<Standing> compared() const override;
  void settle() override;
  void save(v1::MethodState& message) const override;
  Status restore(const v1::MethodState& message) override;

  // Begins at `start`, known to stand at `standing`.
  void begin(const Genome& start, const Standing& standing);
  bool converged() const { return converged_; }
  // Costs known, and how many of the last `span` were less than all before them.
  std::size_t known() const { return costs_.size(); }
  std::size_t improvements(std::size_t span) const;
  const Genome& best() const { return best_; }

 private:
  class Run;
  std::unique_ptr<Run> begin_run() const;
  std::vector<Genome> next_points() const;  // none: NLopt is content
  void add_cost(const Standing& standing);
  void end_search();
  nlopt::algorithm algorithm() const;

  MethodSetup setup_;
  bool restarts_;
  std::vector<std::size_t> moving_;  // genes
  Genome start_;                     // empty: at a random point
  std::vector<double> costs_;        // in the order asked; failures above every cost before them
  Genome best_;
  double best_cost_ = 0;
  std::uint64_t searches_ = 0;  // completed
  bool converged_ = false;

  mutable std::unique_ptr<Run> run_;  // of the search at work; none: not begun here
};

}  // namespace gapfarm
