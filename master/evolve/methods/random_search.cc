#include "master/evolve/methods/random_search.h"

namespace gapfarm {

std::vector<Genome> RandomSearch::propose(const StreamOf& stream_of) const {
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

Status RandomSearch::restore(const v1::MethodState& message) {
  if (!message.has_random_search()) return damaged_method_state("random search");
  begun_ = message.random_search().begun();
  return {};
}

GAPFARM_METHOD(RandomSearch)

}  // namespace gapfarm
