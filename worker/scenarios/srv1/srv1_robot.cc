#include "worker/scenarios/srv1/srv1_robot.h"

#include <algorithm>
#include <cmath>

#include "common/score/motion_model.h"

namespace gapfarm {

std::size_t MotionKey::hash() const {
  const SimSettings& s = settings;
  const SideDrive &left = drive.left, &right = drive.right;
  return hash_of(floor, hash_of({s.contact_length_m, s.track_gauge_m, s.friction, s.friction_ratio,
                                 s.tread_creep, s.com_x_m, s.com_y_m, s.step_rate_hz,
                                 left.speed_m_s, left.lag_s, left.dead_travel_m, right.speed_m_s,
                                 right.lag_s, right.dead_travel_m, drive.duration_s}));
}

namespace {

double at(const ParameterValues& values, Srv1 row) { return values[row_of(row)]; }

SideDrive side_drive(const SideState& side, double full_speed_m_s, double noise_gain) {
  return {side.duty * full_speed_m_s * side.gain * noise_gain, side.lag_s, side.dead_travel_m};
}

NoiseSettings noise_of(const Problem& problem, const ParameterValues& values) {
  const double* noise =
      values.data() + (problem.external ? problem.external->table.first_noise_row()
                                        : row_of(Srv1::kDriveNoiseCommon));
  return {noise[0], noise[1], {noise[2], noise[3]}, {noise[4], noise[5]}};
}

class BulletVehicle final : public Vehicle {
 public:
  BulletVehicle(const SimSettings& settings, StepCounter* steps, MotionMemo<MotionKey>* memo)
      : simulator_(settings, steps), memo_(memo) {}
  Motion run(const DriveInput& drive, const Floor& floor, std::vector<MotionSample>* path,
             double interval_s) override {
    if (memo_ == nullptr || path != nullptr) return simulator_.run(drive, floor, path, interval_s);
    const MotionKey key{simulator_.settings(), drive, floor};
    if (const auto known = memo_->find(key)) return *known;
    const Motion motion = simulator_.run(drive, floor);
    memo_->keep(key, motion);
    return motion;
  }

 private:
  Simulator simulator_;
  MotionMemo<MotionKey>* memo_;
};

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
    Stream stream(stream_key(task.stream(), Purpose::kSimulation, kOfTheSession));
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
        const v1::Trial& planned = task_.plan(i).trial();
        result.set_message(robot_.described("trial " + std::to_string(planned.trial()) +
                                            ", command " + planned.command()));
        break;
      }
    }
    return result;
  }

 private:
  v1::Outcome trial(int i, v1::Trial* logged) {
    const v1::PlannedTrial& planned = task_.plan(i);
    Trial trial = from_proto(planned.trial());
    const CommandSpec command = resolved_command(trial, problem_.commands);
    // A stream of its own for every trial, so that a plan's first trials do not depend on its rest.
    stream_ =
        Stream(stream_key(task_.stream(), Purpose::kSimulation, static_cast<std::uint64_t>(i)));
    const bool moved = planned.moved() || i == 0;
    if (moved) {
      situation_.X_WR = trial.X_WS;
      situation_.last_left = situation_.last_right = 0;  // see backlash in effects/drive.cc
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
    const Pose drawn = drawn_noise(noise, stream_);
    return {rounded(X_WM.x + drawn.x, reading_.quantum_m),
            rounded(X_WM.y + drawn.y, reading_.quantum_m), wrap_angle(X_WM.theta + drawn.theta)};
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

SimSettings sim_settings(const RobotSize& size, const ParameterValues& values,
                         const ActiveEffects& effects) {
  SimSettings s;
  s.size = size;
#define ROW(name, row)
#define SETTING(name, member, row) put(at(values, Srv1::name), s.member);
#include "common/parameters/srv1_rows.inc"
  if (s.robot != RobotModel::kTreads) s.tread_creep = 0;
  effects.settings(s);
  return s;
}

std::vector<Gains> cubature_points(const NoiseSettings& noise) {
  // Gains (l, r) have variance c^2 + s^2 and covariance c^2; along (1, 1)/sqrt(2) that is
  // s^2 + 2 c^2, along (1, -1)/sqrt(2) it is s^2.  The factors sqrt(2) and 1/sqrt(2) cancel.
  const double together = std::hypot(noise.drive_side, std::sqrt(2.0) * noise.drive_common);
  const double apart = noise.drive_side;
  if (together == 0) return {};
  return {{1 + together, 1 + together},
          {1 - together, 1 - together},
          {1 + apart, 1 - apart},
          {1 - apart, 1 + apart}};
}

Gains draw_gains(const NoiseSettings& noise, Stream& stream) {
  const double common = noise.drive_common * stream.normal();
  const double left = noise.drive_side * stream.normal();
  const double right = noise.drive_side * stream.normal();
  if (noise.tails.drive == 0) return {1 + common + left, 1 + common + right};
  const double core = std::sqrt(draw_tail_scale(noise.tails.drive, stream));
  return {std::clamp(1 + core * (common + left), 0.0, 2.0),
          std::clamp(1 + core * (common + right), 0.0, 2.0)};
}

Srv1Robot::Srv1Robot(const ParameterValues& values, StepCounter* steps)
    : Srv1Robot(Problem{}, values, steps, nullptr) {}

Srv1Robot::Srv1Robot(const Problem& problem, const ParameterValues& values, StepCounter* steps,
                     MotionMemo<MotionKey>* memo)
    : effects_(problem.table(), values),
      noise_(noise_of(problem, values)),
      full_speed_m_s_(problem.external ? 1 : at(values, Srv1::kFullSpeed)) {
  if (problem.external) {
    vehicle_ = make_external_vehicle(problem, values, steps);
  } else {
    vehicle_ = std::make_unique<BulletVehicle>(
        sim_settings(problem.treads().size(), values, effects_), steps, memo);
  }
}

NoiseSettings Srv1Robot::foreseen_noise() const {
  NoiseSettings noise = noise_;
  const double spread = effects_.session_spread();
  if (spread > 0) noise.drive_common = std::hypot(noise.drive_common, spread);
  return noise;
}

double Srv1Robot::draw_session_gain(Stream& stream) const {
  const double spread = effects_.session_spread();
  return spread > 0 ? std::clamp(1 + spread * stream.normal(), 0.0, 2.0) : 1;
}

Motion Srv1Robot::run(const DrivenCommand& drive, const Situation& situation, const Gains& gains,
                      std::vector<MotionSample>* path, double interval_s) {
  DriveState state;
  state.left.duty = drive.left;
  state.right.duty = drive.right;
  state.duration_s = drive.duration_s;
  effects_.drive(situation, state);
  Floor floor;
  effects_.floor(situation, floor);
  const DriveInput input{side_drive(state.left, full_speed_m_s_, gains.left),
                         side_drive(state.right, full_speed_m_s_, gains.right), state.duration_s};
  const Motion motion = vehicle_->run(input, floor, path, interval_s);
  ++runs_;
  message_ = motion.message;
  return motion;
}

std::string Srv1Robot::described(const std::string& where) const {
  return message_.empty() ? where : where + ": " + message_;
}

Pose pose_before_end(const std::vector<MotionSample>& path, double age_s) {
  const double when = path.back().t_s - age_s;
  const auto after = std::ranges::upper_bound(path, when, {}, &MotionSample::t_s);
  if (after == path.begin()) return path.front().X_SB;
  if (after == path.end()) return path.back().X_SB;
  const MotionSample& a = *(after - 1);
  const double share = (when - a.t_s) / (after->t_s - a.t_s);
  return a.X_SB * exp(share * log(between(a.X_SB, after->X_SB)));
}

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
    Stream stream(stream_key(task.stream(), Purpose::kSimulation));
    gains = draw_gains(robot.foreseen_noise(), stream);
  }
  const Motion motion =
      robot.run({c.left(), c.right(), c.duration()}, {}, gains, &path, task.interval());
  result.set_outcome(to_outcome(motion.outcome));
  result.set_message(motion.message);
  v1::TraceResult* trace = result.mutable_trace();
  for (const MotionSample& s : path) {
    v1::TraceSample* sample = trace->add_samples();
    sample->set_t(s.t_s);
    *sample->mutable_pose() = to_proto(s.X_SB);
    sample->set_height(s.height_m);
  }
  return result;
}

}  // namespace gapfarm
