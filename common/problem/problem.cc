#include "common/problem/problem.h"

#include <cassert>

#include "common/robot/robot_file.h"

namespace gapfarm {
namespace {

std::vector<CommandSpec> srv1_commands() {
  return {{"forward", 1, 1, 1},      {"backward", -1, -1, 1},   {"turn_ccw", -0.3, 0.3, 1},
          {"turn_cw", 0.3, -0.3, 1}, {"wide_ccw", 0.4, 1.0, 1}, {"wide_cw", 1.0, 0.4, 1}};
}

std::vector<CommandSpec> no_commands() { return {}; }

std::vector<CommandSpec> racquetball_commands() { return {{"serve", 1, 1, 5}}; }

// Windows bring their own durations and commands.
std::vector<CommandSpec> ground_commands() { return {{kWindowCommand, 0, 0, 0}}; }

constexpr ScenarioForm kForms[] = {
    {"srv1", srv1_commands, false, false, false, true, true},
    {"push", no_commands, true},
    {"racquetball", racquetball_commands},
    {.name = "ground", .commands = ground_commands, .robot = true, .windows = true},
    {"external", srv1_commands, false, false, true},
    {.name = "external_runs", .commands = ground_commands, .program = true, .windows = true},
    {.name = "objective", .commands = no_commands, .program = true, .objective = true}};

}  // namespace

bool higher_is_better(FitnessKind kind) {
  return kind == FitnessKind::kLogScore || kind == FitnessKind::kGreatestValue;
}

bool is_value(FitnessKind kind) {
  return kind == FitnessKind::kLeastValue || kind == FitnessKind::kGreatestValue;
}

bool compares_means(FitnessKind kind) {
  return kind == FitnessKind::kRobustMahalanobis || kind == FitnessKind::kCornerDistance;
}

bool comes_apart(FitnessKind kind) {
  return kind == FitnessKind::kLogScore || kind == FitnessKind::kEnergyScore;
}

const char* fitness_name(FitnessKind kind) {
  static constexpr const char* kNames[] = {
      "log_score", "robust_mahalanobis", "energy_score", "corner_distance", "value", "value"};
  return kNames[static_cast<std::size_t>(kind)];
}

const char* fitness_unit(FitnessKind kind) {
  static constexpr const char* kUnits[] = {"nats/trial", "-", "m", "m", "-", "-"};
  return kUnits[static_cast<std::size_t>(kind)];
}

const ParameterTable& Simulated::table() const {
  if (external) return external->table.table();
  if (ground) return ground->table();
  return tracked ? tracked->table() : *parameter_table(scenario).value();
}

Status Simulated::set_robot(const std::string& text, const std::string& path) {
  if (text.find_first_not_of(" \t\r\n\xEF\xBB\xBF") == text.find('<')) {
    return Error{path + ": found XML, expected a robot file; make one of a URDF: gapfarm robot " +
                 path + " --out robot.toml"};
  }
  ASSIGN_OR_RETURN(const auto robot, parse_robot(text, path));
  if (scenario_form(scenario).robot) {
    ground = std::make_shared<const GroundTable>(robot);
    values = table().nominal();
  } else {
    auto table = make_tracked_table(robot);
    if (!table) return Error{path + ": " + table.error().message};
    tracked = *std::move(table);
    values = tracked->values();
  }
  robot_file = text;
  return {};
}

ParameterValues Problem::values_of(const Genome& genome) const {
  ParameterValues all = values;
  if (!genome.empty()) decode(table(), genes, genome, all);
  return all;
}

std::span<const std::string> Problem::channels() const {
  return external ? external->table.declaration().channels : ground->robot().channels;
}

bool Problem::windows() const { return scenario_form(scenario).windows; }

const CommandSpec& Problem::command(std::string_view name) const {
  for (const CommandSpec& spec : commands) {
    if (spec.name == name) return spec;
  }
  assert(false && "commands are checked when trials are read");
  return commands.front();
}

const Piece& Problem::piece(std::string_view name) const {
  for (const Piece& piece : pieces) {
    if (piece.name == name) return piece;
  }
  assert(false && "pieces are checked when trials are read");
  return pieces.front();
}

const ScenarioForm& scenario_form(std::string_view scenario) {
  for (const ScenarioForm& form : kForms) {
    if (scenario == form.name) return form;
  }
  assert(false && "a row of the parameter tables without a form");
  return kForms[0];
}

std::vector<CommandSpec> default_commands(std::string_view scenario) {
  return scenario_form(scenario).commands();
}

}  // namespace gapfarm
