#include "master/ground/program_runs.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>

#include "common/base/guarded.h"
#include "common/base/ranges.h"
#include "common/score/kinematic_body.h"
#include "master/ground/tolerances.h"
#include "master/infer/fit.h"
#include "master/infer/predictor.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr std::size_t kKept = 32;              // motions at values of commands
constexpr double kFar_m = 1e6;                 // where a program that diverges is held to be
constexpr double kReach_m = 0.3;               // of a robot whose size nobody knows
constexpr double kChannelOffsetShare = 0.005;  // of a channel's root mean square
constexpr double kProgramStep = 4;      // of slopes, in tolerances: some print whole millimetres
constexpr double kDelayStep_s = 0.04;   // a multiple of most programs' own
constexpr double kJustBefore_s = 1e-6;  // so that no rounding makes one more of it
constexpr double kUntuned = 0.05;       // m: a unit above it, a foot say, is what no tuning is
constexpr const char* kMarkerRows[] = {"marker.x", "marker.y", "marker.yaw"};
// Of the kinematics' rows, those that say how a program is asked and read.
constexpr const char* kAround[] = {"delay",      "marker_x",   "marker_y",
                                   "marker_yaw", "pose_scale", "aspect"};

// As far as commands and readings go: it has no wheels.
GroundRobot robot_of(const Problem& problem) {
  const auto value = [&](const char* key) { return problem.values[problem.table().row(key)]; };
  GroundRobot robot;
  robot.name = problem.external->table.declaration().name;
  robot.command = CommandKind::kTwist;
  robot.channels.assign(problem.channels().begin(), problem.channels().end());
  robot.motors.delay_s = value("delay");
  robot.X_RM = {value(kMarkerRows[0]), value(kMarkerRows[1]), value(kMarkerRows[2])};
  return robot;
}

// A program, asked for whole runs at many values at once.
class ProgramFarm {
 public:
  ProgramFarm(Farm& farm, const Problem& problem)
      : farm_(farm), problem_(problem), robot_(robot_of(problem)) {}

  const GroundRobot& robot() const { return robot_; }
  const Status& failure() const { return failure_; }

  // Of one set of windows.
  decltype(WindowSet::simulated) simulation(const WindowSet& windows) {
    auto asked = std::make_shared<Asked>(farm_, problem_, windows);
    return [this, asked](const std::vector<Kinematics>& points) { return ends(points, *asked); };
  }

 private:
  struct Asked {
    Asked(Farm& farm, Problem of, const WindowSet& windows)
        : problem(std::move(of)), predictor(farm, with_windows(problem, windows)) {}

    static const Problem& with_windows(Problem& problem, const WindowSet& windows) {
      problem.genes.clear();
      problem.runs = windows.runs;
      problem.log.trials = windows.trials;
      return problem;
    }

    Problem problem;
    Predictor predictor;
    infer::Forward forward =
        infer::remembering([this](const auto& points) { return predictor.attempt(points); }, kKept);
  };

  // Of its robot's own origin; `delay_s`: in place of the point's.
  PredictionRequest request(const Kinematics& at, double delay_s) const {
    Overrides values;
    for (const char* row : kMarkerRows) values[problem_.table().row(row)] = 0;
    for (std::size_t k = 0; k < at.names.size(); ++k) {
      const auto row = problem_.table().find(at.names[k]);
      if (!row) continue;
      const Parameter& p = problem_.table()[*row];
      const double value = at.names[k] == "delay" ? delay_s : at.values[k];
      values[*row] = std::clamp(value, p.lower, p.upper);
    }
    return {values, {}};
  }

  // What the program says of each, nothing where it failed.  A delay between whole kDelayStep_s is
  // interpolated: a program that takes commands at steps of its own jumps by one.
  std::vector<std::optional<std::vector<Pose>>> answers(const std::vector<Kinematics>& points,
                                                        Asked& asked) {
    std::vector<PredictionRequest> requests;
    std::vector<double> shares;
    for (const Kinematics& at : points) {
      const double steps = at.value_or("delay", 0) / kDelayStep_s;
      const double less_s = kDelayStep_s * std::floor(steps) - kJustBefore_s;
      shares.push_back(steps - std::floor(steps));
      requests.push_back(request(at, less_s));
      if (shares.back() > 0) requests.push_back(request(at, less_s + kDelayStep_s));
    }
    auto found = asked.forward(requests);
    if (!found) failure_ = found.error();
    if (const auto& why = asked.predictor.broken()) {
      failure_ = Error{"the program: " + *why, ErrorCode::kSimulation};
    }
    std::vector<std::optional<std::vector<Pose>>> read(points.size());
    if (!found) return read;
    auto next = found->begin();
    for (std::size_t k = 0; k < points.size(); ++k) {
      read[k] = std::move(*next++);
      if (shares[k] == 0) continue;
      const auto& more = *next++;
      if (!more) read[k].reset();
      for (std::size_t i = 0; read[k] && i < more->size(); ++i) {
        Pose& X = (*read[k])[i];
        const Pose& to = (*more)[i];
        X.x += shares[k] * (to.x - X.x);
        X.y += shares[k] * (to.y - X.y);
        X.theta += shares[k] * wrap_angle(to.theta - X.theta);
      }
    }
    return read;
  }

  // What fails is far away, and ends the diagnosis where it is looked at next.
  std::vector<std::vector<Pose>> ends(const std::vector<Kinematics>& points, Asked& asked) {
    std::vector<std::optional<std::vector<Pose>>> all(points.size());
    if (failure_) all = answers(points, asked);
    std::vector<std::vector<Pose>> read;
    const std::vector<Trial>& trials = asked.problem.log.trials;
    for (std::size_t k = 0; k < points.size(); ++k) {
      // What a tracker makes of the robot's motions.
      Kinematics around;
      for (const char* name : kAround) {
        if (points[k].index(name) >= 0) around.add(name, points[k].value_or(name, 0));
      }
      const KinematicBody reading(robot_, around);
      const Pose &X_RM = reading.robot().X_RM, X_MR = inverse(X_RM);
      std::vector<Pose>& there = read.emplace_back();
      for (std::size_t i = 0; i < trials.size(); ++i) {
        const Pose X_SE = all[k] ? between(trials[i].X_WS, (*all[k])[i]) : Pose{kFar_m, 0, 0};
        const Pose X_WS = reading.unobserved(trials[i].X_WS);
        there.push_back(reading.observed(X_WS * X_MR * X_SE * X_RM));
      }
    }
    return read;
  }

  Farm& farm_;
  const Problem& problem_;
  GroundRobot robot_;
  Status failure_;
};

bool is_around(const KinematicRow& row) { return contains(kAround, row.name); }

KinematicRow channel_row(const Problem& problem, const std::string& channel, const char* of,
                         double tolerance) {
  const std::string name = channel + of;
  return {name, problem.values[problem.table().row(name)], tolerance, of + 1, "-"};
}

double root_mean_square(const RunLog& log, std::size_t channel) {
  double sum = 0, count = 1e-9;
  for (const CommandRow& row : flattened(log.runs, &LoggedRun::commands)) {
    sum += row.values[channel] * row.values[channel];
    count += 1;
  }
  return std::sqrt(sum / count);
}

GroundQuestion question_of_program(const Problem& problem, const GroundRobot& robot,
                                   const std::vector<KinematicRow>& tuned, const RunLog& log,
                                   ProgramFarm* program) {
  GroundQuestion question;
  question.simulation = [=](const WindowSet& windows) { return program->simulation(windows); };
  question.rows = tuned;
  for (KinematicRow row : kinematic_rows(robot)) {
    if (!is_around(row)) continue;
    // That of a robot without wheels has no reach.
    if (row.name == "marker_x" || row.name == "marker_y") row.tolerance = kMarkerShare * kReach_m;
    question.rows.push_back(std::move(row));
  }
  add_gyro_scale(log, &question.rows);
  for (GroundHypothesis& h : that_can_show(log, ground_hypotheses(robot))) {
    if (std::all_of(h.freed.begin(), h.freed.end(), is_around)) {
      question.catalogue.push_back(std::move(h));
    }
  }
  const std::vector<std::string>& channels = robot.channels;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const KinematicRow gain = channel_row(problem, channels[c], kChannelGain, kGainShare);
    const double size = std::max(root_mean_square(log, c), 1e-6);
    const KinematicRow offset =
        channel_row(problem, channels[c], kChannelOffset, kChannelOffsetShare * size);
    question.rows.push_back(gain);
    const std::string whose = channels[c] + " of the commands";
    question.catalogue.push_back(
        {"command_gain", {"command_units"}, "the gain of " + whose, {gain}});
    question.catalogue.push_back({"command_offset", {}, "what is added to " + whose, {offset}});
  }
  for (std::size_t k = tuned.size(); k < question.rows.size(); ++k) {
    question.rows[k].step = kProgramStep;
  }
  // The rows of one value are the same to the digit wherever they stand.
  for (GroundHypothesis& h : question.catalogue) {
    for (KinematicRow& freed : h.freed) {
      const KinematicRow* row = find_by(question.rows, freed.name, &KinematicRow::name);
      if (row != nullptr) freed = *row;
      freed.step = kProgramStep;
    }
  }
  return question;
}

// The program's own parameters among the genes.
std::vector<KinematicRow> rows_of_genes(const Problem& problem, const std::vector<Gene>& genes) {
  std::vector<KinematicRow> rows;
  const std::size_t own = problem.external->table.declaration().parameters.size();
  for (const Gene& gene : genes) {
    const Parameter& p = problem.table()[gene.row];
    if (gene.row >= own || p.kind != ParameterKind::kReal || !(gene.lower < gene.upper)) continue;
    rows.push_back({p.key, problem.values[gene.row], kTunedShare * (gene.upper - gene.lower),
                    "value", p.unit});
    rows.back().tuned = true;
  }
  return rows;
}

void put_value(const std::string& name, double value, Problem* problem) {
  std::string key = name;
  if (key.starts_with("marker_")) key[key.find('_')] = '.';
  const auto row = problem->table().find(key);
  if (!row) return;
  const Parameter& p = problem->table()[*row];
  problem->values[*row] = std::clamp(value, p.lower, p.upper);
}

// Fits the program's own parameters, everything else as it is, to the log with what is the wrong
// way round or in another unit put right: they would take it up.
Status tune_program(Farm& farm, const RunLog& log, const GroundDiagnoseOptions& options,
                    std::vector<KinematicRow>* rows, Problem* problem) {
  ProgramFarm program(farm, *problem);
  const GroundRobot& robot = program.robot();
  const GroundQuestion question = question_of_program(*problem, robot, *rows, log, &program);
  GroundSearch sound;
  static_cast<GroundBasis&>(sound) = question;
  sound.log = log;
  GroundWork work = options;
  work.memo = nullptr;
  RETURN_IF_ERROR(search_faults(robot, question, work, &sound));
  const WindowFit fit = WindowFitter(robot, sound.windows).fit(held_rows(*rows));
  RETURN_IF_ERROR(program.failure());
  for (std::size_t k = 0; k < rows->size(); ++k) {
    KinematicRow& row = (*rows)[k];
    put_value(row.name, fit.values[k], problem);
    row.nominal = problem->values[problem->table().row(row.name)];
  }
  return {};
}

}  // namespace

Result<GroundDiagnosis> diagnose_program_runs(Farm& farm, const std::vector<Gene>& tuned,
                                              const RunLog& log,
                                              const GroundDiagnoseOptions& options,
                                              Problem* problem) {
  if (options.reference) {
    return Error{
        "--reference: asks what changed of a ground robot, and a program's is not known; "
        "diagnose both logs"};
  }
  if (log.relative) {
    return Error{
        "poses are relative, each to the one before, which the diagnosis of a program "
        "does not take; give poses in a frame of the world"};
  }
  return guarded([&]() -> Result<GroundDiagnosis> {
    std::vector<KinematicRow> rows = rows_of_genes(*problem, tuned);
    if (!rows.empty()) {
      if (options.on_stage) options.on_stage(kGroundStages[0].name);
      RETURN_IF_ERROR(tune_program(farm, log, options, &rows, problem));
    }
    ProgramFarm program(farm, *problem);
    const GroundRobot& robot = program.robot();
    GroundQuestion question = question_of_program(*problem, robot, rows, log, &program);
    GroundDiagnoseOptions watched = options;
    watched.stopped = [&] { return !program.failure() || (options.stopped && options.stopped()); };
    watched.memo = nullptr;
    auto found = diagnose_by(robot, log, watched, std::move(question));
    RETURN_IF_ERROR(program.failure());
    if (!found) return found;
    for (const ReportedValue& value : found->values) {
      const bool is_tuned = contains(rows, value.name, &KinematicRow::name);
      if (value.named || is_tuned) put_value(value.name, value.reported, problem);
    }
    return found;
  });
}

Result<std::optional<SanityFinding>> check_program_log(Farm& farm, const Problem& problem,
                                                       const RunLog& log,
                                                       const WindowSettings& settings) {
  ProgramFarm program(farm, problem);
  const GroundRobot& robot = program.robot();
  GroundQuestion question;
  question.catalogue = wrong_poses();
  // Of commands, but seen as well without another run of the program.
  std::ranges::move(wrong_sides_of_poses(), std::back_inserter(question.catalogue));
  std::erase_if(question.catalogue,
                [](const GroundHypothesis& h) { return h.metres > kUntuned && h.metres < 1; });
  ASSIGN_OR_RETURN(const auto logged, window_set(robot, log, settings));
  const std::vector<Pose> ends = program.simulation(logged)({Kinematics{}}).front();
  RETURN_IF_ERROR(program.failure());
  // Wherever a window is said to start, the program goes the same way from there.
  question.simulation = [&](const WindowSet& windows) -> decltype(WindowSet::simulated) {
    std::vector<Pose> moved;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      moved.push_back(windows.trials[i].X_WS * between(logged.trials[i].X_WS, ends[i]));
    }
    return [moved](const auto& points) { return std::vector(points.size(), moved); };
  };
  const auto fault = find_ground_fault(robot, log, question, settings);
  if (!fault) return std::optional<SanityFinding>();
  const GroundHypothesis& h = question.catalogue[fault->hypothesis];
  return std::optional(SanityFinding{
      h.name,
      fmt::format("With {} put right, windows end {:.1f} times as near to where the program has "
                  "them.",
                  h.thing, fault->shrinks),
      h.remedy});
}

}  // namespace gapfarm
