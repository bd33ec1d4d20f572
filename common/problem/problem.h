// A problem: scenario + trial log + enabled effects + fitness.  Everything a worker needs but the
// genome, with a hash that names it.
#pragma once

#include <compare>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/external/protocol.h"
#include "common/parameters/ground.h"
#include "common/parameters/table.h"
#include "common/parameters/tracked.h"
#include "common/problem/piece.h"
#include "common/recordings/run.h"
#include "common/recordings/windows.h"
#include "common/residual/outliers.h"
#include "common/trials/trial.h"
#include "gapfarm/v1/problem.pb.h"

namespace gapfarm::v1 {
class Override;
class Task;
}  // namespace gapfarm::v1

namespace gapfarm {

// An atomic command: what the motors are commanded when a trial does not say otherwise.
struct CommandSpec {
  std::string name;
  double left = 0;  // duty, [-1, 1]
  double right = 0;
  double duration_s = 1;

  auto operator<=>(const CommandSpec&) const = default;
};

enum class FitnessKind {
  kLogScore,
  kRobustMahalanobis,
  kEnergyScore,
  kCornerDistance,
  kLeastValue,  // scenario `objective` has these two, and no other scenario has them
  kGreatestValue
};

inline constexpr double kMostOutliers = 0.5;

// One of several things that a search trades off.
struct SearchedObjective {
  std::string name;
  bool maximise = false;
  bool operator==(const SearchedObjective&) const = default;
};
// Of any problem; those of trials: "position" and "heading".
inline constexpr std::size_t kLeastObjectives = 2, kMostObjectives = 8;

struct FitnessSettings {
  FitnessKind kind = FitnessKind::kLogScore;
  double outlier_share = 0.02;  // weight of the density's heavy tail, <= kMostOutliers
  double roll_penalty = 1;      // per rad of the greatest roll of a motion
  double pitch_penalty = 1;     // per rad
  double heave_penalty = 10;    // per m
  double rest_penalty = 1;      // per s beyond rest_limit_s
  double rest_limit_s = 1;      // after the motors stop
  // None: the fitness alone.  Of scenario `objective` the first is the fitness, too.
  std::vector<SearchedObjective> objectives = {};
};

// Whether a greater fitness is the better one.
bool higher_is_better(FitnessKind kind);
// Whether it is an objective's own value.
bool is_value(FitnessKind kind);
// Whether it compares one nominal motion a trial; spread would only cost time.
bool compares_means(FitnessKind kind);
// Whether it can be had of position and of heading apart.
bool comes_apart(FitnessKind kind);
const char* fitness_name(FitnessKind kind);
// Of a fitness value: "m", "nats/trial", "-".
const char* fitness_unit(FitnessKind kind);

enum class SpreadKind { kCubature, kSampled };

struct SpreadSettings {
  SpreadKind kind = SpreadKind::kCubature;
  unsigned replicates = 16;  // kSampled only
};

// Least time between the samples of a simulated path, s: a finer one would only fill the memory.
inline constexpr double kLeastPathInterval_s = 1e-4;

// What is simulated, and how it is scored: what a problem and a model have in common.
struct Simulated {
  std::string scenario = "srv1";
  ParameterValues values;             // one a row of the table
  std::vector<CommandSpec> commands;  // the scenario's, in its order
  std::vector<Piece> pieces;  // of a scenario whose form has them: one a command, in its order
  FitnessSettings fitness;
  SpreadSettings spread;
  // Where there is one: the robot's file, and what it says to scenario `srv1` or `ground`.
  std::string robot_file;
  std::shared_ptr<const TrackedTable> tracked;
  std::shared_ptr<const GroundTable> ground;
  // Where the scenario's form has one: the program that answers.
  std::shared_ptr<const ExternalProgram> external;
  // Where the scenario's form has drives alone: a correction of where they end.
  Residual residual;

  // Of the robot or the program where there is one, else of the scenario.  REQUIRES: a known
  // scenario.
  const ParameterTable& table() const;
  // Takes the robot; `values` become its own.  Errors: parse_robot()'s, a robot that the scenario
  // cannot simulate; `path` names the file.
  Status set_robot(const std::string& text, const std::string& path);
};

struct Problem : Simulated {
  std::vector<Gene> genes;
  TrialLog log;
  // Where the scenario's form has windows: the runs of which `log` is windows.
  std::vector<CommandedRun> runs;

  // What treads are simulated: of the robot where there is one, else the SRV-1's.
  const TrackedTable& treads() const { return tracked ? *tracked : srv1_robot(); }
  // The problem's values with the genes of `genome` put in; an empty genome changes nothing.
  ParameterValues values_of(const Genome& genome) const;
  // Each gene where `values`, one a row, have it.
  Genome genome_of(const ParameterValues& values) const;
  // Of the commands of its runs.  REQUIRES: the scenario's form has windows.
  std::span<const std::string> channels() const;
  bool windows() const;
  // REQUIRES: the command exists.
  const CommandSpec& command(std::string_view name) const;
  // REQUIRES: the scenario's form has pieces and one of this name.
  const Piece& piece(std::string_view name) const;
};

// What configs and logs of a scenario hold beside its parameters.
struct ScenarioForm {
  const char* name;
  // In canonical order with their default duties and durations; none where pieces are the commands.
  std::vector<CommandSpec> (*commands)();
  // Trials name pieces of the config and come with the way of a finger.
  bool pieces = false;
  // There is a robot's file.
  bool robot = false;
  // A program of the user's answers.
  bool program = false;
  // Drives that may be corrected by a Residual.
  bool residual = false;
  // There may be a robot's file, of another robot than the scenario's own.
  bool other_robot = false;
  // Trials are windows of runs.
  bool windows = false;
  // Nothing moves: values go in and a number comes out; there are neither commands nor trials.
  bool objective = false;
};
// REQUIRES: a scenario that has a parameter table.
const ScenarioForm& scenario_form(std::string_view scenario);

// The commands of the scenario's form.  srv1: forward, backward, turn_ccw, turn_cw, wide_ccw,
// wide_cw; racquetball: serve.
std::vector<CommandSpec> default_commands(std::string_view scenario);

// Extra columns of the log stay behind: no simulation depends on them.
v1::Problem to_proto(const Problem& problem);
// Checks scenario, sizes, bounds, commands and finiteness; the error names the field.
Result<Problem> from_proto(const v1::Problem& message);

// A value in place of the problem's; all of `values` that are not the problem's.
v1::Override override_of(std::size_t row, double value);
std::vector<v1::Override> overrides_of(const ParameterValues& problem,
                                       const ParameterValues& values);

v1::Pose to_proto(const Pose& pose);
Pose from_proto(const v1::Pose& pose);
v1::Command to_proto(const CommandSpec& command);
v1::Piece to_proto(const Piece& piece);
Piece from_proto(const v1::Piece& message);
v1::Trial to_proto(const Trial& trial);
Trial from_proto(const v1::Trial& trial);

// Deterministic bytes and their content hash.
std::string serialise(const v1::Problem& message);
std::string problem_hash(const v1::Problem& message);

// What a problem's log is read by: its commands' names, and its runs from their files.
std::vector<std::string> command_names(const std::vector<CommandSpec>& commands);

// Reads commands.csv and poses.csv of each folder, and wheels.csv where it is, one after another.
Result<RunLog> read_run_folders(std::span<const std::string> folders,
                                std::span<const std::string> channels);

// Cuts the runs into windows and makes those the problem's trials, checked as from_proto() does.
// REQUIRES: a problem with a robot.
Status set_runs(const RunLog& all, const WindowSettings& windows, Problem* problem);

// What a task asks, whoever asks it and when: evaluation is pure, so equal questions have equal
// answers.

// Hash of the task and the problem it is about.
std::string question_hash(const std::string& problem_hash, const v1::Task& task);

// The task in a few words, for people: "evaluation of birth 17, replicate 2".
std::string task_label(const v1::Task& task);

// What the task's genome and overrides make of the problem's values, as options of `simulate`:
// "--set friction=0.41 --set mass=0.3"; "" where it changes none.
std::string point_settings(const Problem& problem, const v1::Task& task);

enum ScenarioCan : unsigned { kPredicts = 1, kSimulates = 2, kTraces = 4, kEvaluates = 8 };

// Error: the scenario can nothing of `what`; why, and what can be done instead.  It begins with
// `file`, of which the scenario is; empty: none.
Status check_can(std::string_view scenario, unsigned what, const std::string& file = {});

}  // namespace gapfarm
