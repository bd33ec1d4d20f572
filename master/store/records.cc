#include "master/store/records.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "common/base/hash.h"
#include "common/json/fields.h"
#include "common/json/json.h"
#include "master/store/run_reader.h"

namespace gapfarm {

const char* run_state_name(RunState state) {
  constexpr const char* kNames[] = {"running", "finished", "stopped"};
  return kNames[static_cast<std::size_t>(state)];
}

std::string farm_json(const FarmTally& tally, const Progress& progress) {
  Json json = Json::object();
  for (const FarmTally::Row& row : FarmTally::kRows) json[row.key] = tally.*row.count;
  if (!progress.listen.empty()) json["listen"] = progress.listen;
  if (!progress.fleets.empty()) json["fleets"] = fleets_json(progress.fleets);
  return json_text(json);
}

void read_farm(const std::string& text, Progress* progress) {
  const auto json = parse_json(text);
  if (!json.is_object()) return;
  for (const FarmTally::Row& row : FarmTally::kRows) {
    const auto found = json.find(row.key);
    if (found != json.end() && found->is_number_unsigned()) {
      progress->farm.*row.count = found->get<std::uint64_t>();
    }
  }
  LenientFields(json).field("listen", progress->listen);
  progress->fleets = fleets_of(json.value("fleets", Json()));
}

const char* incident_name(IncidentKind kind) {
  if (kind == IncidentKind::kFailure) return "failure";
  return kind == IncidentKind::kAlarm ? "alarm" : "quarantine";
}

std::string readable_values(const Problem& problem, const Genome& genome) {
  const ParameterTable& table = problem.table();
  const ParameterValues values = problem.values_of(genome);
  Json json = Json::object();
  for (const Gene& gene : problem.genes) {
    const Parameter& row = table[gene.row];
    const double value = values[gene.row];
    switch (row.kind) {
      case ParameterKind::kReal:
        json[row.key] = value;
        break;
      case ParameterKind::kInteger:
        json[row.key] = static_cast<std::int64_t>(value);
        break;
      case ParameterKind::kBoolean:
        json[row.key] = value != 0;
        break;
      case ParameterKind::kChoice:
        json[row.key] = row.choices.at(static_cast<std::size_t>(value));
        break;
    }
  }
  return json_text(json);
}

void summarise_fitness(StoredGeneration& generation, bool higher_is_better) {
  std::vector<double> fitness;
  for (const StoredIndividual& individual : generation.individuals) {
    if (individual.fitness) fitness.push_back(*individual.fitness);
  }
  generation.best = generation.mean = generation.median = generation.worst = std::nullopt;
  if (fitness.empty()) return;
  std::sort(fitness.begin(), fitness.end());
  const std::size_t n = fitness.size();
  generation.best = higher_is_better ? fitness.back() : fitness.front();
  generation.worst = higher_is_better ? fitness.front() : fitness.back();
  generation.mean = std::accumulate(fitness.begin(), fitness.end(), 0.0) / static_cast<double>(n);
  generation.median = 0.5 * (fitness[(n - 1) / 2] + fitness[n / 2]);
}

std::string generation_digest(const std::string& previous, const StoredGeneration& generation) {
  Hasher hasher;
  hasher.add(std::string_view(previous)).add(generation.generation);
  hasher.add(static_cast<std::uint64_t>(generation.individuals.size()));
  for (const StoredIndividual& individual : generation.individuals) {
    hasher.add(individual.birth_id);
    hasher.add(static_cast<std::uint64_t>(individual.genome.size()));
    for (const double gene : individual.genome) hasher.add(gene);
    hasher.add(std::string_view(individual.outcome));
    hasher.add(static_cast<std::uint64_t>(individual.fitness.has_value()));
    hasher.add(individual.fitness.value_or(0.0));
    hasher.add(static_cast<std::uint64_t>(individual.scores));
    for (const auto& [name, value] : individual.objectives) hasher.add(value);
  }
  return hasher.finish();
}

}  // namespace gapfarm
