#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "common/score/fitness.h"
#include "common/score/motion_model.h"
#include "common/trials/context.h"
#include "worker/scenarios/scenario.h"
#include "worker/scenarios/srv1/srv1_motions.h"
#include "worker/scenarios/srv1/srv1_robot.h"
#include "worker/scenarios/srv1/views.h"

namespace gapfarm {
namespace {

// Trials sorted into groups that share their motion.
struct Grouping {
  std::vector<ConditionGroup> groups;
  std::vector<std::size_t> of_trial;
};

struct PreparedTrial {
  DrivenCommand drive;
  TrialContext context;
  std::size_t command = 0;
  Pose X_WS, X_WE;
};

Grouping group_trials(const std::vector<PreparedTrial>& trials, bool by_last_direction) {
  Grouping grouping;
  std::map<std::tuple<double, double, double, int, int, std::size_t>, std::size_t> index;
  for (const PreparedTrial& trial : trials) {
    const int last_left = by_last_direction ? trial.context.last_left : 0;
    const int last_right = by_last_direction ? trial.context.last_right : 0;
    const double time = trial.context.session_time_s;
    const auto [entry, fresh] =
        index.try_emplace({trial.drive.left, trial.drive.right, trial.drive.duration_s, last_left,
                           last_right, trial.command},
                          grouping.groups.size());
    if (fresh) {
      grouping.groups.push_back({trial.drive, last_left, last_right, time, time, trial.command});
      grouping.groups.back().first_trial = grouping.of_trial.size();
    }
    ConditionGroup& group = grouping.groups[entry->second];
    ++group.trials;
    group.first_time_s = std::min(group.first_time_s, time);
    group.last_time_s = std::max(group.last_time_s, time);
    grouping.of_trial.push_back(entry->second);
  }
  return grouping;
}

// An unrecorded move takes up what a side's last direction left open, also for trials
// after it in which the side has not run since.
void forget_over_moves(const std::vector<DrivenCommand>& driven,
                       std::vector<TrialContext>* contexts) {
  for (TrialContext& context : *contexts) {
    if (context.moved) {
      context.last_left = context.last_right = 0;
      continue;
    }
    const std::size_t previous = *context.previous;
    if (driven[previous].left == 0) context.last_left = (*contexts)[previous].last_left;
    if (driven[previous].right == 0) context.last_right = (*contexts)[previous].last_right;
  }
}

// Whether a disc of floor can matter to a motion that ends at X_SE.
bool patch_in_reach(const Floor& floor, const GroupMotion& motion, const Pose& X_SE, double scale) {
  // The farthest contact that the SRV-1's parameter table allows (107 mm), half the way between two
  // samples of the way at the greatest speed, and half the patch's rim.
  constexpr double kRobotReach_m = 0.12;
  const Pose& end = motion.reference();
  const double miss = std::hypot(X_SE.x - end.x, X_SE.y - end.y);
  return std::any_of(floor.patches.begin(), floor.patches.end(), [&](const FrictionDisc& disc) {
    return disc.ratio != 1 && motion.distance_from_path({disc.x_m, disc.y_m}) <
                                  disc.radius_m + kRobotReach_m * scale + miss;
  });
}

// Where the robot may truly have been at the start of a trial that was read there.
std::vector<View> untwisted(std::vector<View> starts, const std::vector<StartTurn>& turns) {
  if (turns.size() == 1 && turns.front().turn_rad == 0) return starts;
  std::vector<View> all;
  for (const StartTurn& turn : turns) {
    for (const View& start : starts) {
      all.push_back({turn.weight * start.weight, start.pose * Pose{0, 0, -turn.turn_rad}});
    }
  }
  return all;
}

// Whether what trials share says too little of one of them.
bool simulate_alone(const Srv1Robot& robot, const ConditionGroup& group, const GroupMotion& motion,
                    const Situation& situation, const Pose& X_SE, double scale,
                    std::size_t headings) {
  if (motion.better_alone()) return true;
  // A lone trial's reference starts at its own heading.
  const bool by_heading = robot.effects().motion_context() & kStartHeading;
  if (by_heading && group.few(headings) && group.trials > 1) return true;
  if (!(robot.effects().motion_context() & kStartPlace)) return false;
  Floor floor;
  robot.effects().floor(situation, floor);
  return patch_in_reach(floor, motion, X_SE, scale);
}

class Srv1Model : public ScenarioModel {
 public:
  explicit Srv1Model(const Problem& problem) : problem_(problem) {
    const std::vector<DrivenCommand> driven = driven_commands(problem.log, problem.commands);
    std::vector<TrialContext> contexts = trial_contexts(problem.log, driven);
    forget_over_moves(driven, &contexts);
    for (std::size_t i = 0; i < driven.size(); ++i) {
      const Trial& trial = problem.log.trials[i];
      trials_.push_back(
          {driven[i], contexts[i], command_index(trial.command), trial.X_WS, trial.X_WE});
    }
    by_drive_ = group_trials(trials_, false);
    by_drive_and_last_ = group_trials(trials_, true);
  }

  Prediction predict(const ParameterValues& values, const PredictOptions& options) const override;

  v1::TaskResult simulate(const ParameterValues& values, const v1::SimulateTask& task,
                          StepCounter* steps) const override {
    return simulate_session(problem_, values, task, steps);
  }

  v1::TaskResult trace(const ParameterValues& values, const v1::TraceTask& task,
                       StepCounter* steps) const override {
    return trace_command(problem_, values, task, steps);
  }

 private:
  std::size_t command_index(const std::string& name) const {
    return static_cast<std::size_t>(&problem_.command(name) - problem_.commands.data());
  }

  std::vector<Gains> draws(const Srv1Robot& robot, const PredictOptions& options,
                           std::size_t group) const;
  TrialPrediction observe(const Srv1Robot& robot, const Views& views, const GroupMotion& motion,
                          const Pose& X_SE, const PreparedTrial& trial) const;

  const Problem& problem_;
  std::vector<PreparedTrial> trials_;
  Grouping by_drive_;
  Grouping by_drive_and_last_;
  mutable MotionMemo<MotionKey> memo_;
};

std::vector<Gains> Srv1Model::draws(const Srv1Robot& robot, const PredictOptions& options,
                                    std::size_t group) const {
  if (problem_.spread.kind != SpreadKind::kSampled) return {};
  Stream stream(evaluation_key(options.stream, group));
  NoiseSettings core = robot.foreseen_noise();
  core.tails = {};
  std::vector<Gains> gains;
  for (unsigned i = 0; i < problem_.spread.replicates; ++i) {
    gains.push_back(draw_gains(core, stream));
  }
  return gains;
}

// From the motion in the start frame to the logged end pose, with the noise of both readings.
TrialPrediction Srv1Model::observe(const Srv1Robot& robot, const Views& views,
                                   const GroupMotion& motion, const Pose& X_SE,
                                   const PreparedTrial& trial) const {
  TrialPrediction prediction;
  PoseNoise noise = robot.noise().pose;
  // Rounding to a grid adds the variance of a uniform error.
  noise.position_m =
      std::hypot(noise.position_m, robot.effects().reading().quantum_m / std::sqrt(12.0));
  const std::vector<View> starts = untwisted(views.recovered(trial.X_WS, noise.position_m),
                                             robot.effects().start_turns(trial.context.moved));
  for (const GroupMotion::Branch& branch : motion.branches()) {
    const Pose X_SA = X_SE * branch.X_EA;
    Alternative alternative;
    alternative.cov = predictive_covariance(X_SA, motion.drive_cov(), noise);
    if (!robot.noise().tails.gaussian()) {
      alternative.reading_cov = predictive_covariance(X_SA, Eigen::Matrix3d::Zero(), noise);
    }
    for (const View& start : starts) {
      const Pose X_WE = start.pose * X_SE * branch.X_EA;
      const Eigen::Matrix3d cov = rotate_covariance(alternative.cov, X_WE.theta);
      for (const View& end : views.observed(X_WE, cov.diagonal().head<2>().cwiseSqrt())) {
        alternative.weight = branch.weight * start.weight * end.weight;
        alternative.X_WM = end.pose;
        prediction.alternatives.push_back(alternative);
      }
    }
  }
  return prediction;
}

Prediction Srv1Model::predict(const ParameterValues& values, const PredictOptions& options) const {
  Prediction prediction;
  prediction.facts.resize(problem_.commands.size());
  // A search never comes back to a genome; means are asked for again where only the view differs.
  Srv1Robot robot(problem_, values, options.steps, options.means_only ? &memo_ : nullptr);
  prediction.tails = robot.noise().tails;
  const Views views(robot.effects());
  const unsigned context = robot.effects().motion_context();
  const Grouping& grouping = (context & kLastDirection) ? by_drive_and_last_ : by_drive_;

  const std::vector<std::uint32_t> wanted = options.of(trials_.size());
  std::set<std::size_t> needed;
  for (std::uint32_t i : wanted) needed.insert(grouping.of_trial[i]);

  const auto failed_group = [&](v1::Outcome outcome, const ConditionGroup& group) {
    prediction.outcome = outcome;
    prediction.message = robot.described("command " + problem_.commands[group.command].name);
    prediction.trials.clear();
    return prediction;
  };

  std::map<std::size_t, GroupMotion> motions;
  for (std::size_t g : needed) {
    ConditionGroup group = grouping.groups[g];
    if (group.trials == 1 && (context & kStartHeading)) {
      group.heading_rad = robot.effects().recover(trials_[group.first_trial].X_WS).theta;
    }
    GroupResult result = simulate_group(robot, group, options, draws(robot, options, g));
    if (result.outcome != v1::OK) return failed_group(result.outcome, grouping.groups[g]);
    prediction.facts[grouping.groups[g].command].include(result.motion.facts());
    motions.emplace(g, std::move(result.motion));
  }

  for (std::uint32_t i : wanted) {
    const PreparedTrial& trial = trials_[i];
    const ConditionGroup& group = grouping.groups[grouping.of_trial[i]];
    const GroupMotion& motion = motions.at(grouping.of_trial[i]);
    const Pose X_WR = robot.effects().recover(trial.X_WS);
    Pose X_SE = motion.end(X_WR.theta, trial.context.session_time_s);
    Situation situation = reference_situation(group);
    situation.X_WR = X_WR;
    situation.far_away = false;
    situation.session_time_s = trial.context.session_time_s;
    if (simulate_alone(robot, group, motion, situation, X_SE, problem_.treads().scale(),
                       options.headings)) {
      const Motion direct = robot.run(group.drive, situation, {});
      if (direct.outcome != MotionOutcome::kOk)
        return failed_group(to_outcome(direct.outcome), group);
      X_SE = motion.spread_end(direct.X_SE);
    }
    if (options.means_only) {
      const double sd_m = robot.noise().pose.position_m;
      const Pose X_WM = options.planned ? robot.effects().observe(X_WR * X_SE)
                                        : views.logged_end(trial.X_WS, X_SE, trial.X_WE, sd_m);
      prediction.trials.push_back({{{1, X_WM}}});
    } else {
      prediction.trials.push_back(observe(robot, views, motion, X_SE, trial));
    }
  }
  prediction.conditions = robot.runs();
  return prediction;
}

}  // namespace

std::unique_ptr<ScenarioModel> prepare_srv1(const Problem& problem) {
  return std::make_unique<Srv1Model>(problem);
}

}  // namespace gapfarm
