#include "common/problem/problem.h"

#include <algorithm>
#include <cassert>
#include <filesystem>
#include <iterator>

#include "common/base/hash.h"
#include "common/base/ranges.h"
#include "common/robot/robot.h"
#include "gapfarm/v1/task.pb.h"

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
    ASSIGN_OR_RETURN(tracked, under(path, make_tracked_table(robot)));
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

Genome Problem::genome_of(const ParameterValues& of) const {
  return mapped(genes, [&](const Gene& gene) { return encode_gene(table(), gene, of[gene.row]); });
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

std::vector<std::string> command_names(const std::vector<CommandSpec>& commands) {
  return mapped(commands, &CommandSpec::name);
}

Result<RunLog> read_run_folders(std::span<const std::string> folders,
                                std::span<const std::string> channels) {
  RunLog all;
  for (const std::string& folder : folders) {
    const std::filesystem::path path(folder);
    if (std::error_code none; std::filesystem::is_regular_file(path, none)) {
      return Error{folder + ": is a file, expected a folder with commands.csv and poses.csv; " +
                   "`gapfarm import runs` makes one of a log"};
    }
    ASSIGN_OR_RETURN(auto log, read_runs((path / "commands.csv").string(),
                                         (path / "poses.csv").string(), channels));
    log.wheel_channels = all.wheel_channels;
    const std::filesystem::path wheels = path / "wheels.csv";
    if (std::error_code none; std::filesystem::exists(wheels, none)) {
      RETURN_IF_ERROR(read_wheel_speeds(wheels.string(), &log));
    }
    for (const auto& [name, read] :
         {std::pair{"gyro.csv", &read_yaw_rates}, {"returns.csv", &read_returns}}) {
      const std::filesystem::path beside = path / name;
      if (std::error_code none; std::filesystem::exists(beside, none)) {
        RETURN_IF_ERROR(read(beside.string(), &log));
      }
    }
    all.wheel_channels = log.wheel_channels;
    all.relative = all.relative || log.relative;
    for (LoggedRun& run : log.runs) {
      // Runs of two folders may bear one name.
      if (folders.size() > 1 && run.session.empty()) run.session = path.filename().string();
      all.runs.push_back(std::move(run));
    }
    all.notes.insert(all.notes.end(), log.notes.begin(), log.notes.end());
  }
  return all;
}

Status set_runs(const RunLog& all, const WindowSettings& windows, Problem* problem) {
  ASSIGN_OR_RETURN(auto cut, cut_windows(all, windows));
  if (problem->ground) {
    const GroundRobot& robot = problem->ground->robot();
    if (is_throttled(robot)) {
      cut = restart_at_measured_speed(all, std::move(cut), windows.run_in_s, kWindowMargin_s);
    }
    cut.log.notes.insert(cut.log.notes.end(), robot.notes.begin(), robot.notes.end());
  }
  problem->runs = std::move(cut.runs);
  problem->log = std::move(cut.log);
  const Result<Problem> sound = from_proto(to_proto(*problem));
  return sound ? Status() : Status(sound.error());
}

namespace {

constexpr std::size_t kPayloadShown = 20;

std::string of_birth(const char* what, const v1::StreamKey& stream) {
  std::string text = what;
  text += " of birth " + std::to_string(stream.birth_id());
  if (stream.replicate() != 0) text += ", replicate " + std::to_string(stream.replicate());
  return text;
}

const v1::Point* point_of(const v1::Task& task) {
  if (task.has_evaluate()) return &task.evaluate().point();
  if (task.has_predict()) return &task.predict().point();
  if (task.has_simulate()) return &task.simulate().point();
  return task.has_trace() ? &task.trace().point() : nullptr;
}

}  // namespace

// Tasks have no map fields, so their serialisation is the same everywhere in one build.
std::string question_hash(const std::string& problem_hash, const v1::Task& task) {
  return content_hash(problem_hash + '\n' + task.SerializeAsString());
}

std::string task_label(const v1::Task& task) {
  switch (task.kind_case()) {
    case v1::Task::kEvaluate:
      return of_birth("evaluation", task.evaluate().stream());
    case v1::Task::kPredict:
      return of_birth("prediction", task.predict().stream());
    case v1::Task::kSimulate:
      return "simulation of a session";
    case v1::Task::kTrace:
      return "trace of command " + task.trace().command().name();
    case v1::Task::kEcho:
      return "echo of '" + task.echo().payload().substr(0, kPayloadShown) + "'";
    default:
      return "task";
  }
}

std::string point_settings(const Problem& problem, const v1::Task& task) {
  const v1::Point* point = point_of(task);
  if (point == nullptr) return {};
  const Genome genome(point->genome().begin(), point->genome().end());
  if (!genome.empty() && genome.size() != problem.genes.size()) return {};
  std::string text;
  const auto add = [&](std::size_t row, double value) {
    text += std::string(text.empty() ? "" : " ") + "--set " + problem.table()[row].key + "=" +
            problem.table().text_of(row, value);
  };
  const ParameterValues values = problem.values_of(genome);
  for (std::size_t i = 0; i < genome.size(); ++i) {
    add(problem.genes[i].row, values[problem.genes[i].row]);
  }
  for (const v1::Override& override : point->overrides()) {
    if (override.parameter() < values.size()) add(override.parameter(), override.value());
  }
  return text;
}

namespace {

// All others predict, simulate and trace.
struct Limited {
  std::string_view scenario;
  unsigned can;
  const char* why;
};

constexpr const char* kFollowsRuns =
    "it follows logged commands: there are no commands of its own to plan or trace; use gapfarm "
    "horizons";
constexpr Limited kLimited[] = {
    {"ground", kPredicts, kFollowsRuns},
    {"external_runs", kPredicts, kFollowsRuns},
    {"objective", kEvaluates,
     "scenario objective has values and a number, and no trials or motions, which this command is "
     "about; it can be checked, evolved, resumed, compared and replayed, and shown by status, "
     "serve "
     "and report"},
    {"racquetball", kTraces,
     "scenario racquetball has paths and no trials: nothing can be predicted or logged; use "
     "gapfarm influence"},
};

}  // namespace

Status check_can(std::string_view scenario, unsigned what, const std::string& file) {
  const auto row = std::ranges::find(kLimited, scenario, &Limited::scenario);
  if (row == std::end(kLimited) || (row->can & what) != 0) return {};
  return Error{(file.empty() ? "" : file + ": ") + row->why};
}

}  // namespace gapfarm
