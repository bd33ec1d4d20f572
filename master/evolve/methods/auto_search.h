// Chooses what searches, and says why.  Where scores are free of noise and all genes are real: a
// generation of random points beside the start, BOBYQA from the best of them for as long as it
// pays, then CMA-ES: from where that ended, or with evaluations enough to find the minimum again,
// from the start, because BOBYQA may have ended in another one.  Else CMA-ES, or differential
// evolution where genes are unordered.
#pragma once

#include "master/evolve/methods/local_search.h"
#include "master/evolve/methods/random_search.h"

namespace gapfarm {

class AutoSearch final : public SearchMethod {
 public:
  explicit AutoSearch(const MethodSetup& setup);

  std::vector<Genome> propose(const StreamOf& stream_of) const override;
  void learn(std::span<const Genome> proposed, std::span<const Standing> standings) override;
  unsigned origin() const override { return current().origin(); }
  std::size_t generation_size() const override;
  std::vector<NamedNumber> figures() const override;
  std::string reason() const override { return reason_; }
  void save(v1::MethodState& message) const override;
  Status restore(const v1::MethodState& message) override;

 private:
  enum Phase { kProbing, kDescending, kGlobal };

  const SearchMethod& current() const;
  void begin_global();
  bool pays() const;
  std::size_t descent_limit() const;

  MethodSetup setup_;  // of the global search
  bool roomy_;         // evaluations enough for CMA-ES to begin anew
  std::string reason_;
  Phase phase_ = kGlobal;
  RandomSearch probe_;
  LocalSearch descent_;
  std::unique_ptr<SearchMethod> global_;
};

}  // namespace gapfarm
