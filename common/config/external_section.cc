#include <filesystem>
#include <set>

#include "common/config/sections.h"
#include "common/problem/message_parts.h"

namespace gapfarm {

namespace {

// Several values in place of one.
void read_objectives(TomlSection& section, std::vector<SearchedObjective>& objectives) {
  std::set<std::string> names;
  for (const char* sense : {"minimise", "maximise"}) {
    for (const std::string& name : section.strings(sense).value_or(std::vector<std::string>())) {
      if (name.empty() || !names.insert(name).second) {
        section.fail(sense, "the value '" + name + "' has no name or is named twice");
      }
      objectives.push_back({name, sense == std::string("maximise")});
    }
  }
  if (objectives.empty()) return;
  if (objectives.size() < kLeastObjectives || objectives.size() > kMostObjectives) {
    section.fail(section.table().contains("minimise") ? "minimise" : "maximise",
                 "minimise and maximise together name " + std::to_string(kLeastObjectives) +
                     " to " + std::to_string(kMostObjectives) +
                     " values; of one value say direction instead");
  }
  if (section.table().contains("direction")) {
    section.fail("direction", "direction is of one value; minimise and maximise say it of several");
  }
}

}  // namespace

void read_objective(TomlSection& section, FitnessSettings& fitness, SpreadSettings& spread) {
  static const std::vector<std::string> kDirections = {"minimise", "maximise", "minimize",
                                                       "maximize"};
  read_objectives(section, fitness.objectives);
  const bool greatest = fitness.objectives.empty()
                            ? section.choice("direction", kDirections).value_or(0) % 2 == 1
                            : fitness.objectives.front().maximise;
  fitness.kind = greatest ? FitnessKind::kGreatestValue : FitnessKind::kLeastValue;
  if (section.boolean("noisy").value_or(false)) spread.kind = SpreadKind::kSampled;
}

bool read_external_section(TomlSection& top, const std::string& config_path,
                           const ProgramStarter& start, Problem& problem) {
  const std::string& scenario = problem.scenario;
  const bool objective = scenario_form(scenario).objective;
  const std::string example =
      std::string("[\"python3\", \"") + (objective ? "objective.py" : "simulator.py") + "\"]";
  const std::string name = objective ? "objective" : "external";
  auto section = top.section(name);
  const auto fail = [&](const std::string& sentence) {
    top.errors().add(section ? section->table().source().begin : top.table().source().begin,
                     sentence);
    return false;
  };
  if (!section) {
    return fail("scenario " + scenario + " needs its program:\n  [" + name +
                "]\n  program = " + example);
  }
  ExternalCommand command;
  command.argv = section->strings("program").value_or(std::vector<std::string>());
  section->read("answer_limit", command.answer_limit_s, 1e-3, 1e6, "s");
  if (objective) read_objective(*section, problem.fitness, problem.spread);
  section->finish();
  if (command.argv.empty() || command.argv[0].empty()) {
    return fail("[" + name + "] program names no program, expected words such as " + example);
  }
  std::error_code ignored;
  command.folder =
      std::filesystem::absolute(config_path, ignored).lexically_normal().parent_path().string();
  const Result<std::string> introduction = start(command);
  if (!introduction) return fail(introduction.error().message);
  auto program = make_external_program(std::move(command), *introduction, objective);
  if (!program) return fail(program.error().message);
  if (Status s = check_program(**program, problem); !s) return fail(s.error().message);
  if (objective && (*program)->table.table().size() == 0) {
    return fail("external program '" + (*program)->command.argv[0] +
                "' declares no parameters, so there is nothing to search");
  }
  problem.external = std::move(*program);
  return true;
}

}  // namespace gapfarm
