// [optimiser]: who searches.
#include <algorithm>
#include <array>
#include <string_view>

#include "common/base/ranges.h"
#include "common/config/config.h"
#include "common/config/sections.h"

namespace gapfarm {
namespace {

const std::vector<std::string> kLocalNames = {"nelder_mead", "subplex", "bobyqa", "cobyla"};
const std::vector<std::string> kRestartNames = {"ipop", "bipop"};
// Of [evolution], what holds for every kind.
constexpr std::array kForAllKinds = {"stop", "elite_replicates", "seed_nominal"};

DefaultOptimiser default_kind(const toml::table& config) {
  const toml::table* evolution = config["evolution"].as_table();
  if (evolution == nullptr) return {};
  for (const auto& [key, value] : *evolution) {
    if (contains(kForAllKinds, key.str())) continue;
    return {OptimiserKind::kGenetic,
            "searches by the genetic algorithm, because [evolution] sets its '" +
                std::string(key.str()) +
                "'; [optimiser] kind = \"auto\" chooses what needs fewer evaluations"};
  }
  return {};
}

using Kind = OptimiserKind;

// Of [optimiser], and who reads it beside `auto`, which may come to most of them.
struct KeyOfKinds {
  std::string_view key;
  std::vector<OptimiserKind> kinds;
  bool automatic = true;
};
const std::vector<KeyOfKinds> kKeysOfKinds = {
    {"differential_weight", {Kind::kDifferentialEvolution, Kind::kDeSimplex}},
    {"crossover_rate", {Kind::kDifferentialEvolution, Kind::kDeSimplex}},
    {"sigma", {Kind::kCmaEs}},
    {"restarts", {Kind::kCmaEs}},
    {"iterations", {Kind::kDeSimplex}, false},
    {"local", {Kind::kLocalSearch, Kind::kDeSimplex}, false},
    {"step", {Kind::kLocalSearch, Kind::kDeSimplex}},
    {"local_evaluations", {Kind::kLocalSearch, Kind::kDeSimplex}},
};

bool reads(OptimiserKind kind, const toml::table& evolution, std::string_view key) {
  if (contains(kForAllKinds, key) || kind == Kind::kGenetic) return true;
  if (key == "asynchronous" || key == "islands") return true;
  if (key != "population") return false;
  return kind == Kind::kNsga2 || kind == Kind::kRandomSearch ||
         evolution.contains("asynchronous") || evolution.contains("islands");
}

bool reads(OptimiserKind kind, std::string_view key) {
  const auto row = std::ranges::find(kKeysOfKinds, key, &KeyOfKinds::key);
  if (row == kKeysOfKinds.end()) return true;
  if (kind == Kind::kAutoSearch) return row->automatic;
  return contains(row->kinds, kind);
}

}  // namespace

const std::vector<std::string>& optimiser_names() {
  static const std::vector<std::string> names = {
      "genetic",
      "nsga2",
#define METHOD(name, file, Class, summary) #name,
#include "common/config/methods.inc"
  };
  return names;
}

std::optional<DefaultOptimiser> default_optimiser(std::string_view config_text) {
  const auto config = parse_toml(config_text, "config");
  if (!config || config->at_path("optimiser.kind")) return std::nullopt;
  return default_kind(*config);
}

std::string unread_by_search(std::string_view config_text, OptimiserKind kind) {
  const auto config = parse_toml(config_text, "config");
  if (!config) return {};
  std::string keys;
  const auto add = [&](std::string_view section, std::string_view key) {
    keys += (keys.empty() ? "" : ", ") + std::string(section) + "." + std::string(key);
  };
  if (const toml::table* evolution = (*config)["evolution"].as_table()) {
    for (const auto& [key, value] : *evolution) {
      if (!reads(kind, *evolution, key.str())) add("evolution", key.str());
    }
  }
  if (const toml::table* optimiser = (*config)["optimiser"].as_table()) {
    for (const auto& [key, value] : *optimiser) {
      if (!reads(kind, key.str())) add("optimiser", key.str());
    }
  }
  if (keys.empty()) return {};
  return "kind = \"" + optimiser_names()[static_cast<std::size_t>(kind)] + "\" does not read " +
         keys;
}

void read_optimiser(TomlSection& top, OptimiserSettings& to) {
  to.kind = default_kind(top.table()).kind;
  top.within("optimiser", [&](TomlSection& section) {
    section.read("kind", to.kind, optimiser_names());
    section.read("population", to.population, 4, 1000000);
    section.read("differential_weight", to.differential_weight, 0.01, 2);
    section.read("crossover_rate", to.crossover_rate, 0, 1);
    section.read("sigma", to.sigma, 1e-4, 1);
    section.read("iterations", to.iterations, 1, 1000000);
    section.read("local", to.local, kLocalNames);
    section.read("step", to.step, 1e-6, 0.5);
    section.read("local_evaluations", to.local_evaluations, 0, 1000000);
    section.read("restarts", to.restarts, kRestartNames);
  });
}

}  // namespace gapfarm
