// Uniform draws: what any search has to beat.
#pragma once

#include "master/evolve/methods/search_method.h"

namespace gapfarm {

class RandomSearch final : public SearchMethod {
 public:
  explicit RandomSearch(const MethodSetup& setup) : setup_(setup) {}

  std::vector<Genome> propose(const StreamOf& stream_of) const override;
  void learn(std::span<const Genome>, std::span<const Standing>) override { begun_ = true; }
  unsigned origin() const override { return kRandom; }
  void save(v1::MethodState& message) const override {
    message.mutable_random_search()->set_begun(begun_);
  }
  Status restore(const v1::MethodState& message) override;

 private:
  MethodSetup setup_;
  bool begun_ = false;
};

}  // namespace gapfarm
