#include "master/evolve/carried.h"

#include <algorithm>

#include "gapfarm/v1/record.pb.h"
#include "master/evolve/individual.h"

namespace gapfarm {
namespace {

template <class Message>
Message parsed_state(std::string_view state) {
  Message message;
  if (!message.ParseFromArray(state.data(), static_cast<int>(state.size()))) message.Clear();
  return message;
}

void add_population(const google::protobuf::RepeatedPtrField<v1::Individual>& population,
                    const GeneSpace& space, std::vector<Individual>* all) {
  for (const v1::Individual& saved : population) {
    if (auto individual = load(saved, space)) all->push_back(*std::move(individual));
  }
}

void add_method(const v1::MethodState& method, const GeneSpace& space, Carried* carried,
                std::vector<Individual>* all) {
  if (method.has_auto_search())
    return add_method(method.auto_search().method(), space, carried, all);
  if (method.has_de_simplex()) {
    return add_method(method.de_simplex().differential(), space, carried, all);
  }
  add_population(method.differential_evolution().population(), space, all);
  const v1::CmaEsState& cma_es = method.cma_es();
  if (cma_es.covariance_size() == static_cast<int>(space.size() * space.size())) {
    carried->spread.clear();
    for (const double c : cma_es.covariance()) {
      carried->spread.push_back(cma_es.sigma() * cma_es.sigma() * c);
    }
  }
}

// The messages share no field number, so a state shows by itself whose it is.
void add_state(std::string_view state, const GeneSpace& space, Carried* carried,
               std::vector<Individual>* all) {
  const auto islands = parsed_state<v1::IslandsState>(state);
  for (const std::string& island : islands.islands()) add_state(island, space, carried, all);
  if (islands.islands_size() > 0) return;
  const auto search = parsed_state<v1::SearchState>(state);
  if (!search.kind().empty()) return add_method(search.method(), space, carried, all);
  add_population(parsed_state<v1::GeneticState>(state).population(), space, all);
}

}  // namespace

Carried carried_by(std::string_view state, std::size_t genes) {
  Carried carried;
  std::vector<Individual> all;
  add_state(state, GeneSpace(std::vector<GeneKind>(genes)), &carried, &all);
  std::stable_sort(all.begin(), all.end(), [](const Individual& a, const Individual& b) {
    return better(a.standing, b.standing);
  });
  for (Individual& individual : all) carried.population.push_back(std::move(individual.genome));
  return carried;
}

}  // namespace gapfarm
