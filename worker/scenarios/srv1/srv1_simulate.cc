#include "worker/scenarios/srv1/srv1_simulate.h"

#include <cmath>

#include "common/score/motion_model.h"
#include "worker/scenarios/srv1/srv1_robot.h"

namespace gapfarm {
namespace {

constexpr double kReadingInterval_s = 0.02;  // between the poses that a stale reading may find

constexpr std::uint64_t kOfTheSession = ~std::uint64_t{0};  // a stream that is no trial's

int sign(double duty) { return (duty > 0) - (duty < 0); }

double rounded(double value, double quantum) {
  return quantum > 0 ? std::round(value / quantum) * quantum : value;
}

// A robot in the world, seen by a camera.
class Session {
 public:
  Session(const Problem& problem, const ParameterValues& values, const v1::SimulateTask& task,
          StepCounter* steps)
      : problem_(problem),
        task_(task),
        robot_(problem, values, steps),
        reading_(robot_.effects().reading()) {
    Stream stream({task.stream().run_seed(), Purpose::kSimulation, task.stream().generation(),
                   task.stream().birth_id(), kOfTheSession});
    gain_ = robot_.draw_session_gain(stream);
  }

  v1::TaskResult drive() {
    v1::TaskResult result;
    v1::SimulateResult* log = result.mutable_simulate();
    result.set_outcome(v1::OK);
    for (int i = 0; i < task_.plan_size(); ++i) {
      const v1::Outcome outcome = trial(i, log->add_trials());
      if (outcome != v1::OK) {
        result.set_outcome(outcome);
        result.set_message("trial " + std::to_string(task_.plan(i).trial().trial()) + ", command " +
                           task_.plan(i).trial().command());
        break;
      }
    }
    result.set_simulated(robot_.simulated_s());
    return result;
  }

 private:
  v1::Outcome trial(int i, v1::Trial* logged) {
    const v1::PlannedTrial& planned = task_.plan(i);
    Trial trial = from_proto(planned.trial());
    const CommandSpec command = resolved_command(trial, problem_.commands);
    // A stream of its own for every trial, so that a plan's first trials do not depend on its rest.
    stream_ = Stream({task_.stream().run_seed(), Purpose::kSimulation, task_.stream().generation(),
                      task_.stream().birth_id(), static_cast<std::uint64_t>(i)});
    const bool moved = planned.moved() || i == 0;
    if (moved) {
      situation_.X_WR = trial.X_WS;
      situation_.last_left = situation_.last_right = 0;  // see backlash.cc
    }
    situation_.moved = moved;
    situation_.session_time_s = trial.t_s.value_or(0);

    Gains gains = draw_gains(robot_.noise(), stream_);
    const DriveBranch event = robot_.effects().draw(stream_);
    gains.left *= event.left_gain * gain_;
    gains.right *= event.right_gain * gain_;
    const bool stale = stream_.bernoulli(reading_.stale_share);
    const bool sampled = task_.path_interval() > 0;
    std::vector<MotionSample> path;
    const Motion motion = robot_.run({command.left, command.right, command.duration_s}, situation_,
                                     gains, sampled || stale ? &path : nullptr,
                                     sampled ? task_.path_interval() : kReadingInterval_s);
    if (motion.outcome != MotionOutcome::kOk) return to_outcome(motion.outcome);

    const Pose X_WS = situation_.X_WR;
    const LoggedMotion facts = facts_of(trial, command, moved);
    const Outlier outlier = make_outlier(facts, corrected(motion.X_SE, facts, &path), &path);
    const Pose X_SR = outlier.X_SR;
    const Pose X_SE = stale ? pose_before_end(path, reading_.stale_age_s) : outlier.X_SE;
    trial.X_WS = measured(X_WS);
    const double turn_rad =
        robot_.effects().draw_start_turn(moved, stream_) + outlier.start_turn_rad;
    if (turn_rad != 0) trial.X_WS.theta = wrap_angle(trial.X_WS.theta + turn_rad);
    trial.X_WE = measured(X_WS * X_SE);
    if (sampled) {
      for (const MotionSample& s : path) trial.path.push_back({s.t_s, measured(X_WS * s.X_SB)});
    }
    *logged = to_proto(trial);

    situation_.X_WR = X_WS * X_SR;
    if (command.left != 0) situation_.last_left = sign(command.left);
    if (command.right != 0) situation_.last_right = sign(command.right);
    return v1::OK;
  }

  LoggedMotion facts_of(const Trial& trial, const CommandSpec& command, bool moved) const {
    return {trial.command,        situation_.X_WR,       command.left,
            command.right,        command.duration_s,    situation_.session_time_s,
            situation_.last_left, situation_.last_right, moved};
  }

  // The shifted end; the path grows into it with time.
  static Pose shifted(const Pose& X_SE, const Eigen::Vector3d& shift,
                      std::vector<MotionSample>* path) {
    for (MotionSample& s : *path) {
      const double share = path->back().t_s > 0 ? s.t_s / path->back().t_s : 0;
      s.X_SB = s.X_SB * Pose{share * shift[0], share * shift[1], share * shift[2]};
    }
    return X_SE * Pose{shift[0], shift[1], shift[2]};
  }

  // The end with the problem's correction.
  Pose corrected(const Pose& X_SE, const LoggedMotion& facts,
                 std::vector<MotionSample>* path) const {
    const ResidualField& field = problem_.residual.field;
    if (field.empty()) return X_SE;
    return shifted(X_SE, residual_shift(field, facts, facts.X_WS * X_SE), path);
  }

  // Where the robot is at the end and where it is read, and how far off its start's heading is.
  struct Outlier {
    Pose X_SR, X_SE;
    double start_turn_rad = 0;
  };

  Outlier make_outlier(const LoggedMotion& facts, const Pose& X_SR,
                       std::vector<MotionSample>* path) {
    const auto& outliers = problem_.residual.outliers;
    Outlier drawn{X_SR, X_SR, 0};
    if (!outliers || !may_be_outlier(*outliers, facts)) return drawn;
    const bool is_outlier = stream_.bernoulli(outliers->share);
    const double amount = outliers->least + (outliers->most - outliers->least) * stream_.uniform();
    const bool first = stream_.bernoulli(0.5);
    if (outliers->kind == OutlierKind::kTurned) {
      drawn.start_turn_rad = is_outlier ? -amount : 0;
      return drawn;
    }
    const Pose X_WE = facts.X_WS * X_SR;
    const Pose end = is_outlier ? outlier_end(*outliers, facts, X_WE, amount, first)
                                : rest_end(*outliers, facts, X_WE);
    drawn.X_SE = between(facts.X_WS, end);
    if (outliers->kind == OutlierKind::kSide) {
      drawn.X_SR = shifted(X_SR, local_difference(X_SR, drawn.X_SE), path);
    }
    return drawn;
  }

  Pose measured(const Pose& X_WR) {
    PoseNoise noise = robot_.noise().pose;
    const double core = std::sqrt(draw_tail_scale(robot_.noise().tails.reading, stream_));
    noise.position_m *= core;
    noise.heading_rad *= core;
    const Pose X_WM = robot_.effects().observe(X_WR);
    const double x = X_WM.x + noise.position_m * stream_.normal();
    const double y = X_WM.y + noise.position_m * stream_.normal();
    return {rounded(x, reading_.quantum_m), rounded(y, reading_.quantum_m),
            wrap_angle(X_WM.theta + noise.heading_rad * stream_.normal())};
  }

  const Problem& problem_;
  const v1::SimulateTask& task_;
  Srv1Robot robot_;
  Reading reading_;
  double gain_ = 1;
  Situation situation_;
  Stream stream_{StreamKey{}};
};

}  // namespace

v1::TaskResult simulate_session(const Problem& problem, const ParameterValues& values,
                                const v1::SimulateTask& task, StepCounter* steps) {
  return Session(problem, values, task, steps).drive();
}

v1::TaskResult trace_command(const Problem& problem, const ParameterValues& values,
                             const v1::TraceTask& task, StepCounter* steps) {
  v1::TaskResult result;
  Srv1Robot robot(problem, values, steps);
  std::vector<MotionSample> path;
  const v1::Command& c = task.command();
  Gains gains;
  if (task.noisy()) {
    Stream stream({task.stream().run_seed(), Purpose::kSimulation, task.stream().generation(),
                   task.stream().birth_id(), task.stream().replicate()});
    gains = draw_gains(robot.foreseen_noise(), stream);
  }
  const Motion motion =
      robot.run({c.left(), c.right(), c.duration()}, {}, gains, &path, task.interval());
  result.set_outcome(to_outcome(motion.outcome));
  result.set_simulated(motion.duration_s);
  v1::TraceResult* trace = result.mutable_trace();
  trace->set_rest_time(motion.rest_time_s);
  for (const MotionSample& s : path) {
    v1::TraceSample* sample = trace->add_samples();
    sample->set_t(s.t_s);
    *sample->mutable_pose() = to_proto(s.X_SB);
    sample->set_height(s.height_m);
    sample->set_roll(s.roll_rad);
    sample->set_pitch(s.pitch_rad);
  }
  return result;
}

}  // namespace gapfarm
