#include "master/cli/data/export_source.h"

#include <cmath>
#include <filesystem>

#include "common/problem/run_files.h"
#include "common/trials/files.h"
#include "master/ground/reference.h"
#include "master/io/log_checks/run_checks.h"
#include "master/store/run_reader.h"

namespace gapfarm {
namespace {

constexpr double kLeastShift_s = 1e-3;
constexpr double kEachRow_s = 1e-3;  // a horizon that every way between two poses is longer than

// Whether rows that hold wheels and increments were read at other times after all.
bool clocks_are_apart(const GroundRobot& robot, const GroundReference& fit) {
  const double own = robot.motors.delay_s;
  return std::abs(fit.value_or("delay", own) - own) > kLeastShift_s;
}

// Friction as the run has it, where the run searched for it.
RosFriction simulated_friction(const Problem& problem, const Model& model) {
  RosFriction friction;
  for (const Gene& gene : problem.genes) {
    const std::string& key = problem.table()[gene.row].key;
    if (key != "friction" && key != "friction_ratio") continue;
    const GroundRobot robot = problem.ground->robot_at(model.values);
    friction.along = robot.friction;
    friction.across = robot.friction * robot.friction_ratio;
    friction.from = "as evolved; other values may explain the motion as well";
  }
  return friction;
}

Status check_ground(const Problem& problem, const std::string& source) {
  if (problem.ground) return {};
  return Error{source + ": scenario " + problem.scenario +
               " has no robot file whose values could go back; only ground robots have"};
}

}  // namespace

Result<GroundReference> fit_source(const GroundSource& source, Console& console) {
  const GroundRobot& robot = source.robot;
  ASSIGN_OR_RETURN(const auto logged, read_run_folders(source.logs, robot.channels));
  const RunChecks checks = check_runs(logged, robot.motors.command_timeout_s);
  for (const SanityFinding& f : checks.findings) {
    if (checks.none_is_left(logged)) return Error{f.text + " " + f.remedy};
    console.note("warning: " + f.text + " " + f.remedy);
  }
  const RunLog log = without(logged, checks);
  console.note("fitting the robot's kinematics to the log");
  // Increments err each by itself: a window of several knows nothing that they do not, unless
  // wheels were read at other times.
  const bool together = log.relative && shares_a_clock(log);
  const WindowSettings each_row = {{kEachRow_s}, 0.5}, summed = {{0.5, 2, 5}, 0.5};
  const auto ask = [&](const WindowSettings& windows) {
    return ask_what_changed(robot, log, windows, 1, nullptr, /*alone=*/true);
  };
  ASSIGN_OR_RETURN(auto asked, ask(together ? each_row : summed));
  if (together && clocks_are_apart(robot, *asked.reference)) {
    ASSIGN_OR_RETURN(asked, ask(summed));
  }
  return *std::move(asked.reference);
}

Result<std::optional<ReportedValues>> values_in(const std::string& folder) {
  const auto path = std::filesystem::path(folder) / "values.json";
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return std::optional<ReportedValues>();
  ASSIGN_OR_RETURN(const auto text, read_text_file(path.string()));
  ASSIGN_OR_RETURN(auto values, parse_values(text, path.string()));
  return std::optional(std::move(values));
}

Result<GroundSource> read_ground_source(const std::string& source, Console& console) {
  std::error_code ignored;
  if (std::filesystem::is_regular_file(source, ignored)) {
    ASSIGN_OR_RETURN(const auto config,
                     open_config(source, {}, console, [](Config&) { return Status(); }));
    RETURN_IF_ERROR(check_ground(config.problem, source));
    return GroundSource{
        config.problem.ground->robot_at(config.problem.values), config.trial_files, {}};
  }
  const auto reader = RunReader::open(source);
  if (!reader) {
    return Error{source + ": neither a config nor the diagnosis of a ground robot nor a run (" +
                 reader.error().message + ")"};
  }
  ASSIGN_OR_RETURN(const auto problem, stored_problem(*reader));
  RETURN_IF_ERROR(check_ground(problem, source));
  ASSIGN_OR_RETURN(const auto model, read_model_of(source, console));
  return GroundSource{problem.ground->robot(), model.data.files,
                      simulated_friction(problem, model)};
}

}  // namespace gapfarm
