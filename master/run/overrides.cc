#include "master/run/overrides.h"

#include <nlohmann/json.hpp>
#include <type_traits>

#include "common/json/json.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;
using Ours = EvolutionOverrides;
using Theirs = EvolutionSettings;

// Every override: its name, and its place here and among the settings.
template <class Visit>
void each(Visit visit) {
  visit("generations", &Ours::generations, &Theirs::generations);
  visit("evaluations", &Ours::evaluations, &Theirs::evaluations);
  visit("time_s", &Ours::time_s, &Theirs::time_s);
  visit("target_fitness", &Ours::target_fitness, &Theirs::target_fitness);
  visit("population", &Ours::population, &Theirs::population);
}

}  // namespace

void EvolutionOverrides::apply(EvolutionSettings& settings) const {
  each([&](const char*, auto ours, auto theirs) {
    if (this->*ours) settings.*theirs = *(this->*ours);
  });
  if (population) settings.optimiser.population = *population;
}

void EvolutionOverrides::merge(const EvolutionOverrides& later) {
  each([&](const char*, auto ours, auto) {
    if (later.*ours) this->*ours = later.*ours;
  });
}

std::string EvolutionOverrides::to_json() const {
  Json json = Json::object();
  each([&](const char* name, auto ours, auto) {
    if (this->*ours) json[name] = *(this->*ours);
  });
  return json_text(json);
}

EvolutionOverrides EvolutionOverrides::from_json(const std::string& text) {
  EvolutionOverrides overrides;
  const Json json = parse_json(text);
  if (!json.is_object()) return overrides;
  each([&](const char* name, auto ours, auto) {
    using Value = typename std::decay_t<decltype(overrides.*ours)>::value_type;
    if (json.contains(name) && json[name].is_number()) {
      overrides.*ours = json[name].template get<Value>();
    }
  });
  return overrides;
}

}  // namespace gapfarm
