// Uniform draws: what any search has to beat.
#include "master/evolve/methods/search_method.h"

namespace gapfarm {
namespace {

class RandomSearch final : public SearchMethod {
 public:
  explicit RandomSearch(const MethodSetup& setup) : setup_(setup) {}

  std::vector<Genome> propose(const StreamOf& stream_of) const override {
    std::vector<Genome> proposed;
    const std::size_t size = setup_.settings.population.value_or(setup_.population);
    if (!begun_ && !setup_.start.empty()) proposed.push_back(setup_.start);
    for (const Genome& genome : setup_.given) {
      if (!begun_ && proposed.size() < size) proposed.push_back(genome);
    }
    while (proposed.size() < size) {
      Stream stream = stream_of(proposed.size());
      proposed.push_back(setup_.space.random(stream));
    }
    return proposed;
  }
  void learn(std::span<const Genome>, std::span<const Standing>) override { begun_ = true; }
  unsigned origin() const override { return kRandom; }
  void save(v1::MethodState& message) const override {
    message.mutable_random_search()->set_begun(begun_);
  }
  Status restore(const v1::MethodState& message) override {
    if (!message.has_random_search()) return damaged_method_state("random search");
    begun_ = message.random_search().begun();
    return {};
  }

 private:
  MethodSetup setup_;
  bool begun_ = false;
};

}  // namespace

GAPFARM_METHOD(RandomSearch)

}  // namespace gapfarm
