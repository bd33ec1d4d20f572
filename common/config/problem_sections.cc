// [commands], [fitness] and [spread]: the rest of the problem.
#include <set>

#include "common/config/sections.h"

namespace gapfarm {

const std::vector<std::string>& fitness_names() {
  static const std::vector<std::string> names = {
      fitness_name(FitnessKind::kLogScore), fitness_name(FitnessKind::kRobustMahalanobis),
      fitness_name(FitnessKind::kEnergyScore), fitness_name(FitnessKind::kCornerDistance)};
  return names;
}

const std::vector<std::string>& spread_names() {
  static const std::vector<std::string> names = {"cubature", "sampled"};
  return names;
}

void read_commands(TomlSection& top, std::vector<CommandSpec>& commands) {
  auto section = top.section("commands");
  if (!section) return;
  for (CommandSpec& command : commands) {
    auto own = section->section(command.name);
    if (!own) continue;
    own->read("left", command.left, -1, 1, "(duty)");
    own->read("right", command.right, -1, 1, "(duty)");
    own->read("duration", command.duration_s, 0, 60, "s");
    own->finish();
  }
  section->finish();
}

void read_fitness(TomlSection& top, FitnessSettings& fitness) {
  auto section = top.section("fitness");
  if (!section) return;
  read_fitness_of(*section, fitness);
  section->finish();
}

void read_fitness_of(TomlSection& section, FitnessSettings& fitness) {
  section.read("kind", fitness.kind, fitness_names());
  section.read("outlier_share", fitness.outlier_share, 0, kMostOutliers);
  section.read("roll_penalty", fitness.roll_penalty, 0, kUnbounded, "per rad");
  section.read("pitch_penalty", fitness.pitch_penalty, 0, kUnbounded, "per rad");
  section.read("heave_penalty", fitness.heave_penalty, 0, kUnbounded, "per m");
  section.read("rest_penalty", fitness.rest_penalty, 0, kUnbounded, "per s");
  section.read("rest_limit", fitness.rest_limit_s, 0, 60, "s");
  const auto objectives = section.strings("objectives");
  if (!objectives) return;
  for (const std::string& name : *objectives) {
    fitness.objectives.push_back({name, higher_is_better(fitness.kind)});
  }
  const std::set<std::string> names(objectives->begin(), objectives->end());
  if (objectives->size() != 2 || names != std::set<std::string>{"position", "heading"} ||
      !comes_apart(fitness.kind)) {
    section.fail("objectives",
                 "objectives are [\"position\", \"heading\"], of log_score or energy_score");
  }
}

void read_spread(TomlSection& top, SpreadSettings& spread) {
  auto section = top.section("spread");
  if (!section) return;
  section->read("kind", spread.kind, spread_names());
  section->read("replicates", spread.replicates, 2, 100000);
  if (spread.kind == SpreadKind::kCubature && section->table().contains("replicates")) {
    section->fail("replicates",
                  "replicates belong to kind = \"sampled\"; cubature has fixed points");
  }
  section->finish();
}

}  // namespace gapfarm
