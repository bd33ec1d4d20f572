// [optimiser]: who searches.
#include <algorithm>
#include <array>

#include "common/config/sections.h"
#include "common/config/stages.h"

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
    const bool for_all =
        std::find(kForAllKinds.begin(), kForAllKinds.end(), key.str()) != kForAllKinds.end();
    if (for_all) continue;
    return {OptimiserKind::kGenetic,
            "searches by the genetic algorithm, because [evolution] sets its '" +
                std::string(key.str()) +
                "'; [optimiser] kind = \"auto\" chooses what needs fewer evaluations"};
  }
  return {};
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

void read_optimiser(TomlSection& top, OptimiserSettings& to) {
  to.kind = default_kind(top.table()).kind;
  auto section = top.section("optimiser");
  if (!section) return;
  section->read("kind", to.kind, optimiser_names());
  section->read("population", to.population, 4, 1000000);
  section->read("differential_weight", to.differential_weight, 0.01, 2);
  section->read("crossover_rate", to.crossover_rate, 0, 1);
  section->read("sigma", to.sigma, 1e-4, 1);
  section->read("iterations", to.iterations, 1, 1000000);
  section->read("local", to.local, kLocalNames);
  section->read("step", to.step, 1e-6, 0.5);
  section->read("local_evaluations", to.local_evaluations, 0, 1000000);
  section->read("restarts", to.restarts, kRestartNames);
  section->finish();
}

}  // namespace gapfarm
