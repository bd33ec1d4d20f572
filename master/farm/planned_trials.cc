#include "master/farm/planned_trials.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "common/base/ranges.h"
#include "common/random/stream.h"
#include "common/score/motion_model.h"
#include "master/farm/farm.h"

namespace gapfarm {
namespace {

template <class T>
const T& pick(const std::vector<T>& from, Stream& stream) {
  return from[stream.below(from.size())];
}

std::vector<CommandSpec> driven_commands(const Problem& problem, const SimulateSettings& settings) {
  if (settings.commands.empty()) return problem.commands;
  return mapped(settings.commands, [&](const std::string& name) { return problem.command(name); });
}

constexpr double kFingerSpeed_m_s = 0.1;
constexpr double kFingerClearance_m = 0.03;  // of its start from the circle round the piece

// The finger of a trial with a piece: from outside, from any side, straight past the centroid at up
// to half the piece's radius, and on to at most as far behind it.
void draw_finger(const Piece& piece, Stream& stream, Trial& trial) {
  const Eigen::Vector2d middle = centroid(piece);
  const double radius =
      max_of(piece.corners, [&](const auto& corner) { return (corner - middle).norm(); });
  const Pose X_WC = trial.X_WS * Pose{middle[0], middle[1], 0};
  const double reach = radius + kFingerClearance_m;
  const Pose X_WF = X_WC * Pose{0, 0, stream.uniform(-std::numbers::pi, std::numbers::pi)};
  const double aside = radius * stream.uniform(-0.5, 0.5);
  const double end = radius * stream.uniform(-0.5, 0.5);
  const Pose from = X_WF * Pose{-reach, aside, 0};
  const Pose to = X_WF * Pose{end, aside, 0};
  trial.tip = {{0, from.x, from.y}, {(reach + end) / kFingerSpeed_m_s, to.x, to.y}};
  trial.left = trial.right = trial.duration_s = std::nullopt;
  trial.t_s = std::nullopt;
}

// A free trial bears the name of the config's command that it is most like: duties at the least
// angle.
const CommandSpec& nearest_command(const std::vector<CommandSpec>& commands, double left,
                                   double right) {
  const auto likeness = [&](const CommandSpec& c) {
    const double lengths = std::hypot(c.left, c.right) * std::hypot(left, right);
    return lengths > 0 ? (c.left * left + c.right * right) / lengths : 0;
  };
  return *std::ranges::max_element(commands, [&](const CommandSpec& a, const CommandSpec& b) {
    return likeness(a) < likeness(b);
  });
}

double draw_duty(const SimulateSettings& settings, Stream& stream) {
  const Interval& range = settings.duty_range;
  const double duty = stream.uniform(range.lower, range.upper);
  if (settings.duty_step <= 0) return duty;
  return std::clamp(settings.duty_step * std::round(duty / settings.duty_step), -1.0, 1.0);
}

// Command, duties and duration.
void draw_drive(const std::vector<CommandSpec>& commands, const SimulateSettings& settings,
                Stream& stream, Trial& trial) {
  if (settings.plan == PlanKind::kFree) {
    const Interval& duration = settings.duration_range_s;
    const double left = draw_duty(settings, stream), right = draw_duty(settings, stream);
    trial.command = nearest_command(commands, left, right).name;
    trial.left = left;
    trial.right = right;
    trial.duration_s = stream.uniform(duration.lower, duration.upper);
    return;
  }
  const CommandSpec& command = pick(commands, stream);
  const double level = pick(settings.levels, stream);
  trial.command = command.name;
  trial.left = level * command.left;
  trial.right = level * command.right;
  trial.duration_s =
      settings.durations_s.empty() ? command.duration_s : pick(settings.durations_s, stream);
}

}  // namespace

std::vector<std::vector<v1::PlannedTrial>> draw_plan(const Problem& problem,
                                                     const SimulateSettings& settings,
                                                     std::uint64_t seed) {
  const std::vector<CommandSpec> commands = driven_commands(problem, settings);
  std::vector<std::vector<v1::PlannedTrial>> plan(settings.sessions);
  for (unsigned s = 0; s < settings.sessions; ++s) {
    // The last word keeps the plan's draws apart from those of the trials' noise.
    Stream stream({seed, Purpose::kSimulation, 1, s, ~std::uint64_t{0}});
    double t_s = 0;
    for (unsigned i = 0; i < settings.trials_per_session; ++i) {
      v1::PlannedTrial planned;
      planned.set_moved(i % std::max(1u, settings.chain) == 0);
      Trial trial;
      trial.session = "s" + std::to_string(s + 1);
      trial.trial = i;
      trial.t_s = t_s;
      draw_drive(commands, settings, stream, trial);
      const double lower = 0.15 * settings.arena_m;
      const double upper = 0.85 * settings.arena_m;
      trial.X_WS.x = stream.uniform(lower, upper);
      trial.X_WS.y = stream.uniform(lower, upper);
      trial.X_WS.theta = stream.uniform(-std::numbers::pi, std::numbers::pi);
      t_s += trial.duration_s.value_or(0) + settings.pause_s * stream.uniform(0.75, 1.25);
      if (!problem.pieces.empty()) draw_finger(problem.piece(trial.command), stream, trial);
      *planned.mutable_trial() = to_proto(trial);
      plan[s].push_back(std::move(planned));
    }
  }
  return plan;
}

std::vector<std::vector<v1::PlannedTrial>> plan_of(const Problem& problem, const TrialLog& log) {
  const std::vector<TrialContext> contexts =
      trial_contexts(log, driven_commands(log, problem.commands));
  std::vector<std::vector<v1::PlannedTrial>> plan;
  std::map<std::string, std::size_t> sessions;
  for (std::size_t i = 0; i < log.trials.size(); ++i) {
    const auto [entry, fresh] = sessions.try_emplace(log.trials[i].session, plan.size());
    if (fresh) plan.emplace_back();
    v1::PlannedTrial planned;
    planned.set_moved(contexts[i].moved);
    Trial trial = log.trials[i];
    trial.path.clear();
    *planned.mutable_trial() = to_proto(trial);
    plan[entry->second].push_back(std::move(planned));
  }
  return plan;
}

std::vector<v1::Task> simulate_tasks(const std::vector<std::vector<v1::PlannedTrial>>& plan,
                                     const std::vector<v1::Override>& overrides, std::uint64_t seed,
                                     double path_interval_s) {
  std::vector<v1::Task> tasks;
  for (std::size_t s = 0; s < plan.size(); ++s) {
    v1::Task task;
    v1::SimulateTask* simulate = task.mutable_simulate();
    simulate->mutable_point()->mutable_overrides()->Add(overrides.begin(), overrides.end());
    simulate->mutable_stream()->set_run_seed(seed);
    simulate->mutable_stream()->set_birth_id(s);
    simulate->mutable_plan()->Add(plan[s].begin(), plan[s].end());
    simulate->set_path_interval(path_interval_s);
    tasks.push_back(std::move(task));
  }
  return tasks;
}

Problem without_log(Problem problem) {
  problem.log = {};
  problem.genes.clear();
  problem.fitness.kind = FitnessKind::kLogScore;
  return problem;
}

Result<TrialLog> simulated_log(const std::vector<v1::TaskResult>& results, const std::string& what,
                               const std::string& remedy) {
  TrialLog log;
  for (const v1::TaskResult& result : results) {
    RETURN_IF_ERROR(ended_well(result, what, remedy));
    for (const v1::Trial& trial : result.simulate().trials()) {
      log.trials.push_back(from_proto(trial));
    }
  }
  return log;
}

}  // namespace gapfarm
