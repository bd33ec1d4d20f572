// [commands], [fitness] and [spread]: the rest of the problem.
#include <filesystem>
#include <set>

#include "common/base/ranges.h"
#include "common/config/sections.h"
#include "common/problem/message_parts.h"
#include "common/trials/text/csv.h"

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
  top.within("commands", [&](TomlSection& section) {
    for (CommandSpec& command : commands) {
      section.within(command.name, [&](TomlSection& own) { command_rows(own, command); });
    }
  });
}

void read_fitness(TomlSection& section, FitnessSettings& fitness) {
  section.read("kind", fitness.kind, fitness_names());
  fitness_rows(section, fitness);
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
  top.within("spread", [&](TomlSection& section) {
    section.read("kind", spread.kind, spread_names());
    section.read("replicates", spread.replicates, 2, 100000);
    if (spread.kind == SpreadKind::kCubature && section.table().contains("replicates")) {
      section.fail("replicates",
                   "replicates belong to kind = \"sampled\"; cubature has fixed points");
    }
  });
}

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
  bool noisy = false;
  section.read("noisy", noisy);
  if (noisy) spread.kind = SpreadKind::kSampled;
}

bool read_external_section(TomlSection& top, const std::string& config_path,
                           const ProgramStarter& start, const Problem* known, Problem& problem) {
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
  section->read("program", command.argv);
  section->read("answer_limit", command.answer_limit_s, 1e-3, 1e6, "s");
  if (objective) read_objective(*section, problem.fitness, problem.spread);
  section->finish();
  if (command.argv.empty() || command.argv[0].empty()) {
    return fail("[" + name + "] program names no program, expected words such as " + example);
  }
  if (known != nullptr) {
    problem.external = known->external;
    return true;
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

namespace {

// A pose in a log is that of the frame in which the corners are listed, or of the centroid.
const std::vector<std::string> kOrigins = {"frame", "centroid"};

void read_piece(TomlSection& section, std::vector<Piece>& pieces) {
  TomlErrors& errors = section.errors();
  Piece piece;
  section.read("name", piece.name);
  // check_piece() misses those that are not there.
  const auto corners =
      section.rows("corners", 2, "corners are pairs in m: [[0, 0], [0.1, 0], ...]");
  if (corners)
    piece.corners = mapped(*corners, [](const auto& c) { return Eigen::Vector2d(c[0], c[1]); });
  const std::size_t origin = section.choice("origin", kOrigins).value_or(0);
  piece_rows(section, piece);
  section.finish();
  if (contains(pieces, piece.name, &Piece::name))
    errors.add(section.table(), "piece " + quoted_word(piece.name) + " is written twice");
  if (Status s = check_piece(piece); !s) {
    if (errors.empty()) errors.add(section.table(), s.error().message);
    return;
  }
  if (origin == 1) {
    const Eigen::Vector2d middle = centroid(piece);
    for (Eigen::Vector2d& corner : piece.corners) corner -= middle;
  }
  pieces.push_back(std::move(piece));
}

}  // namespace

void read_pieces(TomlSection& top, const ScenarioForm& form, std::vector<Piece>& pieces,
                 std::vector<CommandSpec>& commands) {
  if (!form.pieces) return;
  auto sections = top.sections(
      "pieces", std::string("scenario ") + form.name +
                    " needs sections [[pieces]] with name, corners, thickness and mass");
  for (TomlSection& section : sections) read_piece(section, pieces);
  for (const Piece& piece : pieces) commands.push_back({piece.name, 0, 0, 0});
}

}  // namespace gapfarm
