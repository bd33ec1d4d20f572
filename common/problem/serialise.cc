// Problems to protobuf and back.
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "common/base/hash.h"
#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/config/toml_section.h"
#include "common/problem/message_parts.h"
#include "common/problem/problem.h"
#include "common/trials/read.h"
#include "gapfarm/v1/task.pb.h"

namespace gapfarm {
namespace {

Error invalid(const std::string& what) { return Error{"problem: " + what}; }

bool finite(const Pose& X) {
  return std::isfinite(X.x) && std::isfinite(X.y) && std::isfinite(X.theta);
}

// Rows that a message must have: those from a second one of a kind on, and those of a program's
// channels, which are younger, are omitted where they do nothing, so that problems without them
// are, to the byte, what they were before there were any.
std::size_t least_rows(const Problem& problem) {
  const ParameterTable& table = problem.table();
  if (problem.external && problem.windows()) return table.size() - 2 * problem.channels().size();
  for (std::size_t e = 0; e < table.effects().size(); ++e) {
    if (!table.effects()[e].repeats.empty()) return table.effect_row(e);
  }
  return table.size();
}

std::size_t rows_to_write(const Problem& problem) {
  std::size_t rows = problem.values.size();
  const ParameterTable& table = problem.table();
  if (rows != table.size()) return rows;
  while (rows > least_rows(problem) && problem.values[rows - 1] == table[rows - 1].nominal) --rows;
  return rows;
}

Status read_values(const v1::Problem& message, Problem* problem) {
  const ParameterTable& table = problem->table();
  const auto count = static_cast<std::size_t>(message.values_size());
  if (count < least_rows(*problem) || count > table.size()) {
    return invalid(std::to_string(message.values_size()) + " parameter values, but scenario '" +
                   problem->scenario + "' has " + std::to_string(table.size()) +
                   "; master and worker must be the same build");
  }
  for (std::size_t i = 0; i < table.size(); ++i) {
    problem->values.push_back(i < count ? message.values(static_cast<int>(i)) : table[i].nominal);
    RETURN_IF_ERROR(table.check(i, problem->values.back()));
  }
  for (const v1::Gene& gene : message.genes()) {
    if (gene.parameter() >= table.size()) {
      return invalid("gene of parameter row " + std::to_string(gene.parameter()));
    }
    RETURN_IF_ERROR(table.check(gene.parameter(), gene.lower()));
    RETURN_IF_ERROR(table.check(gene.parameter(), gene.upper()));
    if (gene.lower() > gene.upper() || (gene.log_scale() && gene.lower() <= 0)) {
      return invalid("gene " + table[gene.parameter()].key + " has an empty range");
    }
    problem->genes.push_back({gene.parameter(), gene.lower(), gene.upper(),
                              gene.log_scale() ? ParameterScale::kLog : ParameterScale::kLinear});
  }
  return {};
}

Status read_pieces(const v1::Problem& message, Problem* problem) {
  const bool wanted = scenario_form(problem->scenario).pieces;
  const std::string asked = wanted ? "' needs pieces" : "' has no pieces";
  if (wanted != (message.pieces_size() > 0))
    return invalid("scenario '" + problem->scenario + asked);
  for (const v1::Piece& p : message.pieces()) {
    Piece piece = from_proto(p);
    if (p.x_size() != p.y_size()) return invalid("piece '" + p.name() + "' has half a corner");
    RETURN_IF_ERROR(under("problem", check_piece(piece)));
    problem->pieces.push_back(std::move(piece));
  }
  if (!wanted) return {};
  for (std::size_t i = 0; i < problem->commands.size(); ++i) {
    if (i < problem->pieces.size() && problem->commands[i].name == problem->pieces[i].name)
      continue;
    return invalid("command '" + problem->commands[i].name + "' is not the piece in its place");
  }
  return {};
}

// A finger's way, where the scenario has pieces.
Status check_tip(const Trial& trial, bool wanted, const std::string& where) {
  if (!wanted) return {};
  if (trial.tip.size() < 2) {
    return invalid(where + ": has " + std::to_string(trial.tip.size()) +
                   " samples of the finger's way, expected at least 2; are they in tips.csv?");
  }
  for (std::size_t i = 0; i < trial.tip.size(); ++i) {
    const TipSample& s = trial.tip[i];
    if (!std::isfinite(s.t_s + s.x + s.y) || (i > 0 && !(s.t_s > trial.tip[i - 1].t_s))) {
      return invalid(where + ": the finger's way needs finite samples at increasing times");
    }
  }
  const double lasts_s = trial.tip.back().t_s - trial.tip.front().t_s;
  if (lasts_s <= kLongestFingersWay_s) return {};
  return invalid(where + ": the finger's way takes " + formatted("%g", lasts_s) +
                 " s, expected up to " + formatted("%g", kLongestFingersWay_s) + " s; t is in s");
}

// A robot, where the scenario has one.
Status read_robot(const v1::Problem& message, Problem* problem) {
  const ScenarioForm& form = scenario_form(problem->scenario);
  if (message.robot().empty() && form.robot) return invalid("scenario 'ground' needs a robot");
  if (message.robot().empty()) return {};
  if (!form.robot && !form.other_robot) return invalid(problem->scenario + " has no robot");
  RETURN_IF_ERROR(under("problem", problem->set_robot(message.robot(), "robot")));
  problem->values.clear();
  return {};
}

// Runs of commands, where the scenario has them.  REQUIRES: robot and program are read.
Status read_runs(const v1::Problem& message, Problem* problem) {
  if (message.runs_size() == 0) return {};
  if (!problem->windows()) return invalid("scenario '" + problem->scenario + "' has no runs");
  const auto channels = static_cast<int>(problem->channels().size());
  for (const v1::Run& run : message.runs()) {
    CommandedRun to{run.start(), run.speed(), run.turn(), {}};
    if (run.values_size() != run.t_size() * channels) return invalid("a run with half a command");
    double sum = to.start_s + to.speed_m_s + to.turn_rad_s;
    for (int i = 0; i < run.t_size(); ++i) {
      const double* values = run.values().data() + i * channels;
      CommandRow row{run.t(i), {values, values + channels}};
      sum = std::accumulate(values, values + channels, sum + row.t_s);
      if (i > 0 && row.t_s < run.t(i - 1)) return invalid("a run whose times go back");
      to.commands.push_back(std::move(row));
    }
    if (!std::isfinite(sum)) return invalid("a run with numbers that are not finite");
    problem->runs.push_back(std::move(to));
  }
  return {};
}

// A window lies in a run and after its start.
Status check_window(const Trial& trial, const Problem& problem, const std::string& where) {
  if (!problem.windows()) {
    return trial.run ? Status(invalid(where + ": is a window of a run")) : Status();
  }
  if (!trial.run || *trial.run >= problem.runs.size() || !trial.t_s || !trial.duration_s) {
    return invalid(where + ": is no window of one of the problem's runs");
  }
  constexpr double kLongest_s = 1e5;
  const CommandedRun& run = problem.runs[*trial.run];
  if (run.commands.empty() || !(*trial.t_s >= run.start_s) || !(*trial.duration_s > 0) ||
      !(*trial.t_s + *trial.duration_s - run.start_s < kLongest_s)) {
    return invalid(where +
                   ": does not lie in its run, or ends 1e5 s or more after it began; name "
                   "runs apart where nothing was driven, and write times in s");
  }
  return {};
}

Status read_commands(const v1::Problem& message, Problem* problem) {
  for (const v1::Command& c : message.commands()) {
    RETURN_IF_ERROR(under("problem", check_command(c)));
    problem->commands.push_back({c.name(), c.left(), c.right(), c.duration()});
  }
  if (!problem->commands.empty() || scenario_form(problem->scenario).objective) return {};
  return invalid("no commands");
}

std::string where_of(const Trial& trial) {
  return "trial " + trial.session + "/" + std::to_string(trial.trial);
}

Status read_trials(const v1::Problem& message, Problem* problem) {
  for (const v1::Trial& t : message.trials()) {
    Trial trial = from_proto(t);
    const std::string where = where_of(trial);
    RETURN_IF_ERROR(under("problem", check_trial(trial, *problem)));
    RETURN_IF_ERROR(check_tip(trial, !problem->pieces.empty(), where));
    RETURN_IF_ERROR(check_window(trial, *problem, where));
    problem->log.trials.push_back(std::move(trial));
  }
  return {};
}

}  // namespace

Status check_command(const v1::Command& c) {
  const bool duties = std::abs(c.left()) <= 1 && std::abs(c.right()) <= 1;
  if (duties && c.duration() >= 0 && c.duration() <= 60) return {};
  return Error{"command '" + c.name() + "' needs duties in [-1, 1] and a duration in [0, 60] s"};
}

Status check_trial(const Trial& trial, const Problem& problem) {
  const std::vector<std::string> names = command_names(problem.commands);
  if (!contains(names, trial.command)) {
    return Error{where_of(trial) + ": unknown command '" + trial.command + "'" +
                 suggestion(trial.command, names)};
  }
  if (!finite(trial.X_WS) || !finite(trial.X_WE)) {
    return Error{where_of(trial) + ": a pose is not finite"};
  }
  const double lasts_s = trial.duration_s.value_or(0);
  const bool bounded = std::abs(trial.left.value_or(0)) <= 1 &&
                       std::abs(trial.right.value_or(0)) <= 1 && lasts_s >= 0 &&
                       (problem.windows() || lasts_s <= 60);
  if (bounded && std::isfinite(trial.t_s.value_or(0))) return {};
  return Error{where_of(trial) +
               ": needs duties in [-1, 1], a duration in [0, 60] s and a finite t"};
}

v1::Pose to_proto(const Pose& pose) {
  v1::Pose message;
  message.set_x(pose.x);
  message.set_y(pose.y);
  message.set_theta(pose.theta);
  return message;
}

Pose from_proto(const v1::Pose& pose) { return {pose.x(), pose.y(), pose.theta()}; }

v1::Command to_proto(const CommandSpec& command) {
  v1::Command message;
  message.set_name(command.name);
  message.set_left(command.left);
  message.set_right(command.right);
  message.set_duration(command.duration_s);
  return message;
}

v1::Piece to_proto(const Piece& piece) {
  v1::Piece message;
  message.set_name(piece.name);
  for (const Eigen::Vector2d& corner : piece.corners) {
    message.add_x(corner[0]);
    message.add_y(corner[1]);
  }
  message.set_thickness(piece.thickness_m);
  message.set_mass(piece.mass_kg);
  message.set_symmetry(piece.symmetry);
  return message;
}

Piece from_proto(const v1::Piece& message) {
  Piece piece{message.name(), {}, message.thickness(), message.mass(), message.symmetry()};
  for (int i = 0; i < std::min(message.x_size(), message.y_size()); ++i) {
    piece.corners.emplace_back(message.x(i), message.y(i));
  }
  return piece;
}

v1::Trial to_proto(const Trial& trial) {
  v1::Trial message;
  message.set_session(trial.session);
  message.set_trial(trial.trial);
  if (trial.t_s) message.set_t(*trial.t_s);
  message.set_command(trial.command);
  if (trial.left) message.set_left(*trial.left);
  if (trial.right) message.set_right(*trial.right);
  if (trial.duration_s) message.set_duration(*trial.duration_s);
  *message.mutable_start() = to_proto(trial.X_WS);
  *message.mutable_end() = to_proto(trial.X_WE);
  for (const PathSample& sample : trial.path) {
    v1::PathSample* to = message.add_path();
    to->set_t(sample.t_s);
    *to->mutable_pose() = to_proto(sample.pose);
  }
  if (trial.run) message.set_run(*trial.run);
  for (const TipSample& sample : trial.tip) {
    v1::TipSample* to = message.add_tip();
    to->set_t(sample.t_s);
    to->set_x(sample.x);
    to->set_y(sample.y);
  }
  return message;
}

Trial from_proto(const v1::Trial& message) {
  Trial trial;
  trial.session = message.session();
  trial.trial = message.trial();
  if (message.has_t()) trial.t_s = message.t();
  trial.command = message.command();
  if (message.has_left()) trial.left = message.left();
  if (message.has_right()) trial.right = message.right();
  if (message.has_duration()) trial.duration_s = message.duration();
  trial.X_WS = from_proto(message.start());
  trial.X_WE = from_proto(message.end());
  for (const v1::PathSample& sample : message.path()) {
    trial.path.push_back({sample.t(), from_proto(sample.pose())});
  }
  for (const v1::TipSample& sample : message.tip()) {
    trial.tip.push_back({sample.t(), sample.x(), sample.y()});
  }
  if (message.has_run()) trial.run = message.run();
  return trial;
}

v1::Override override_of(std::size_t row, double value) {
  v1::Override override;
  override.set_parameter(static_cast<std::uint32_t>(row));
  override.set_value(value);
  return override;
}

std::vector<v1::Override> overrides_of(const ParameterValues& problem,
                                       const ParameterValues& values) {
  return filtered(
      indices(values.size()), [&](std::size_t row) { return values[row] != problem[row]; },
      [&](std::size_t row) { return override_of(row, values[row]); });
}

v1::Problem to_proto(const Problem& problem) {
  v1::Problem message;
  message.set_scenario(problem.scenario);
  const std::size_t rows = rows_to_write(problem);
  for (std::size_t i = 0; i < rows; ++i) message.add_values(problem.values[i]);
  for (const Gene& gene : problem.genes) {
    v1::Gene* to = message.add_genes();
    to->set_parameter(static_cast<std::uint32_t>(gene.row));
    to->set_lower(gene.lower);
    to->set_upper(gene.upper);
    to->set_log_scale(gene.scale == ParameterScale::kLog);
  }
  for (const CommandSpec& command : problem.commands) *message.add_commands() = to_proto(command);
  write_fitness(problem.fitness, message.mutable_fitness());
  message.mutable_spread()->set_kind(static_cast<v1::Spread::Kind>(problem.spread.kind));
  message.mutable_spread()->set_replicates(problem.spread.replicates);
  for (const Piece& piece : problem.pieces) *message.add_pieces() = to_proto(piece);
  for (const Trial& trial : problem.log.trials) *message.add_trials() = to_proto(trial);
  write_external(problem, &message);
  TomlLines residual;
  write_residual(problem, residual);
  message.set_residual(residual.text());
  if (!problem.robot_file.empty()) message.set_robot(problem.robot_file);
  for (const CommandedRun& run : problem.runs) {
    v1::Run* to = message.add_runs();
    to->set_start(run.start_s);
    to->set_speed(run.speed_m_s);
    to->set_turn(run.turn_rad_s);
    for (const CommandRow& row : run.commands) {
      to->add_t(row.t_s);
      for (const double value : row.values) to->add_values(value);
    }
  }
  return message;
}

Result<Problem> from_proto(const v1::Problem& message) {
  Problem problem;
  problem.scenario = message.scenario();
  if (auto table = parameter_table(problem.scenario); !table) return table.error();
  RETURN_IF_ERROR(read_robot(message, &problem));
  RETURN_IF_ERROR(read_external(message, &problem));
  RETURN_IF_ERROR(read_runs(message, &problem));
  RETURN_IF_ERROR(read_values(message, &problem));
  RETURN_IF_ERROR(read_commands(message, &problem));
  RETURN_IF_ERROR(read_pieces(message, &problem));
  if (!v1::Fitness::Kind_IsValid(message.fitness().kind()) ||
      !v1::Spread::Kind_IsValid(message.spread().kind())) {
    return invalid("unknown kind of fitness or spread; master and worker must be the same build");
  }
  problem.fitness = fitness_of_message(message.fitness());
  if (problem.fitness.kind == FitnessKind::kCornerDistance && problem.pieces.empty()) {
    return invalid("fitness corner_distance needs pieces, which scenario '" + problem.scenario +
                   "' does not have; choose another");
  }
  problem.spread = {static_cast<SpreadKind>(message.spread().kind()),
                    message.spread().replicates()};
  RETURN_IF_ERROR(check_score(problem.fitness, problem.spread));
  RETURN_IF_ERROR(read_trials(message, &problem));
  RETURN_IF_ERROR(read_residual(message, &problem));
  return problem;
}

std::string serialise(const v1::Problem& message) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&coded);
  }
  return bytes;
}

std::string problem_hash(const v1::Problem& message) { return content_hash(serialise(message)); }

}  // namespace gapfarm
