#include <cmath>
#include <map>
#include <vector>

#include "common/parameters/table.h"
#include "common/problem/problem.h"
#include "common/random/stream.h"
#include "common/score/fitness.h"
#include "gapfarm/v1/task.pb.h"
#include "worker/scenarios/push/pushed_piece.h"
#include "worker/scenarios/scenario.h"
#include "worker/sim/step_counter.h"

namespace gapfarm {
namespace {

class PushSession {
 public:
  PushSession(const Problem& problem, const ParameterValues& values, const v1::SimulateTask& task,
              StepCounter* steps)
      : problem_(problem),
        values_(values),
        task_(task),
        steps_(steps),
        noise_(push_noise(values)) {}

  v1::TaskResult run() {
    v1::TaskResult result;
    result.set_outcome(v1::OK);
    for (int i = 0; i < task_.plan_size(); ++i) {
      const v1::Outcome outcome = trial(i, result.mutable_simulate()->add_trials());
      if (outcome == v1::OK) continue;
      const v1::Trial& t = task_.plan(i).trial();
      result.set_outcome(outcome);
      result.set_message("trial " + std::to_string(t.trial()) + ", piece " + t.command() +
                         (outcome == v1::INVALID_REQUEST ? ": there is no finger's way" : ""));
      break;
    }
    return result;
  }

 private:
  PushedPiece& pushed(const std::string& name) {
    const auto found = pieces_.find(name);
    if (found != pieces_.end()) return found->second;
    const Piece& piece = problem_.piece(name);
    const auto index = static_cast<std::size_t>(&piece - problem_.pieces.data());
    return pieces_.try_emplace(name, piece, index, values_).first->second;
  }

  v1::Outcome trial(int i, v1::Trial* logged) {
    Trial trial = from_proto(task_.plan(i).trial());
    if (trial.tip.size() < 2) return v1::INVALID_REQUEST;
    // A stream of its own for every trial, so that a plan's first trials do not depend on its rest.
    Stream stream(stream_key(task_.stream(), Purpose::kSimulation, static_cast<std::uint64_t>(i)));
    PushedPiece& piece = pushed(trial.command);
    const bool sampled = task_.path_interval() > 0;
    std::vector<PathSample> path;
    const Pose X_WR = trial.X_WS;
    PushedPiece::Push push =
        piece.push(X_WR, trial.tip, sampled ? &path : nullptr, task_.path_interval());
    count_step(steps_);
    if (push.outcome != v1::OK) return push.outcome;
    const double aside = noise_.slide * push.slid_m;
    const double turned = noise_.turn_rad_m * push.slid_m;
    const double dx = aside * stream.normal();
    const double dy = aside * stream.normal();
    push.X_WE = push.X_WE * Pose{dx, dy, turned * stream.normal()};
    trial.X_WS = measured(piece, piece.logged_start(X_WR), stream);
    trial.X_WE = measured(piece, push.X_WE, stream);
    for (const PathSample& s : path) {
      trial.path.push_back({s.t_s, measured(piece, s.pose, stream)});
    }
    *logged = to_proto(trial);
    return v1::OK;
  }

  Pose measured(const PushedPiece& piece, const Pose& X_WR, Stream& stream) const {
    const Pose X_WM = piece.observe(X_WR);
    const Pose noise = drawn_noise(noise_.pose, stream);
    return {X_WM.x + noise.x, X_WM.y + noise.y, wrap_angle(X_WM.theta + noise.theta)};
  }

  const Problem& problem_;
  const ParameterValues& values_;
  const v1::SimulateTask& task_;
  StepCounter* steps_;
  PushNoise noise_;
  std::map<std::string, PushedPiece> pieces_;
};

// The pushes of a plan.  Every piece is put down where its trial begins, whatever happened before;
// it is logged there and at its end with the effects and the noise of both readings.  A trial
// without a finger's way is an invalid request.
v1::TaskResult simulate_pushes(const Problem& problem, const ParameterValues& values,
                               const v1::SimulateTask& task, StepCounter* steps) {
  return PushSession(problem, values, task, steps).run();
}

// The true way of the piece in the push of `task.trial`, from where the log has its start; noisy:
// from beside it by a reading's noise.
v1::TaskResult trace_push(const Problem& problem, const ParameterValues& values,
                          const v1::TraceTask& task, StepCounter* steps) {
  if (task.trial() >= problem.log.trials.size()) {
    return failed_task(v1::INVALID_REQUEST, "trial " + std::to_string(task.trial()) +
                                                " is to be traced, and the log has " +
                                                std::to_string(problem.log.trials.size()) +
                                                " pushes");
  }
  const Trial& trial = problem.log.trials[task.trial()];
  const Piece& piece = problem.piece(trial.command);
  PushedPiece pushed(piece, static_cast<std::size_t>(&piece - problem.pieces.data()), values);
  Pose X_WR = pushed.start_of(trial.X_WS);
  if (task.noisy()) {
    Stream stream(stream_key(task.stream(), Purpose::kSimulation));
    X_WR = X_WR * drawn_noise(push_noise(values).pose, stream);
  }
  std::vector<PathSample> path;
  const PushedPiece::Push push = pushed.push(X_WR, trial.tip, &path, task.interval());
  count_step(steps);
  v1::TaskResult result;
  result.set_outcome(push.outcome);
  for (const PathSample& s : path) {
    v1::TraceSample* sample = result.mutable_trace()->add_samples();
    sample->set_t(s.t_s);
    *sample->mutable_pose() = to_proto(s.pose);
  }
  return result;
}

using Offsets = std::vector<Pose>;

// Equally weighted deviations of the true start from the logged one: third-degree
// cubature of their Gaussian (Arasaratnam and Haykin 2009, sec. III).
Offsets cubature_offsets(const PoseNoise& noise) {
  const double reach = std::sqrt(3.0);
  Offsets offsets;
  for (double Pose::*at : {&Pose::x, &Pose::y, &Pose::theta}) {
    const double away = reach * (at == &Pose::theta ? noise.heading_rad : noise.position_m);
    for (const double side : {away, -away}) offsets.emplace_back().*at = side;
  }
  return offsets;
}

class PushModelOfLog : public ScenarioModel {
 public:
  explicit PushModelOfLog(const Problem& problem) : problem_(problem) {}

  Prediction predict(const ParameterValues& values, const PredictOptions& options) const override;

  v1::TaskResult simulate(const ParameterValues& values, const v1::SimulateTask& task,
                          StepCounter* steps) const override {
    return simulate_pushes(problem_, values, task, steps);
  }

  v1::TaskResult trace(const ParameterValues& values, const v1::TraceTask& task,
                       StepCounter* steps) const override {
    return trace_push(problem_, values, task, steps);
  }

 private:
  Offsets offsets(const PushNoise& noise, const PredictOptions& options, std::uint32_t trial) const;

  const Problem& problem_;
  mutable MotionMemo<PushKey> memo_;
};

Offsets PushModelOfLog::offsets(const PushNoise& noise, const PredictOptions& options,
                                std::uint32_t trial) const {
  if (options.means_only) return {Pose()};
  if (problem_.spread.kind == SpreadKind::kCubature) return cubature_offsets(noise.pose);
  Stream stream(evaluation_key(options.stream, trial));
  Offsets drawn;
  for (unsigned i = 0; i < problem_.spread.replicates; ++i) {
    drawn.push_back(drawn_noise(noise.pose, stream));
  }
  return drawn;
}

// The logged ends of a push from every one of the starts, as mean and covariance.
Alternative summarise(const std::vector<Pose>& ends) {
  Alternative whole;
  whole.X_WM = ends.front();
  if (ends.size() == 1) return whole;
  const double share = 1 / static_cast<double>(ends.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Pose& end : ends) mean += share * local_difference(ends.front(), end);
  whole.X_WM = ends.front() * Pose{mean[0], mean[1], wrap_angle(mean[2])};
  for (const Pose& end : ends) {
    const Eigen::Vector3d d = local_difference(whole.X_WM, end);
    whole.cov += share * d * d.transpose();
  }
  return whole;
}

Prediction PushModelOfLog::predict(const ParameterValues& values,
                                   const PredictOptions& options) const {
  Prediction prediction;
  prediction.facts.resize(problem_.commands.size());
  const PushNoise noise = push_noise(values);
  // A search never comes back to a genome; a derivative moves some pieces, and not the others.
  MotionMemo<PushKey>* memo = options.means_only ? &memo_ : nullptr;
  std::map<std::size_t, PushedPiece> pieces;
  for (const std::uint32_t i : options.of(problem_.log.trials.size())) {
    const Trial& trial = problem_.log.trials[i];
    const Piece& piece = problem_.piece(trial.command);
    const auto index = static_cast<std::size_t>(&piece - problem_.pieces.data());
    PushedPiece& pushed = pieces.try_emplace(index, piece, index, values).first->second;
    const Pose X_WR = pushed.start_of(trial.X_WS);
    std::vector<Pose> ends;
    double slid_m = 0;
    for (const Pose& offset : offsets(noise, options, i)) {
      const PushedPiece::Push push = pushed.push(X_WR * offset, i, trial.tip, memo);
      count_step(options.steps);  // a push takes milliseconds: fine enough to see one that hangs
      if (push.outcome != v1::OK) {
        prediction.outcome = push.outcome;
        prediction.message = "piece " + piece.name + ", trial " + std::to_string(trial.trial) +
                             " of session " + trial.session;
        prediction.trials.clear();
        return prediction;
      }
      ends.push_back(pushed.observe(push.X_WE));
      slid_m += push.slid_m;
      prediction.facts[index].include(facts_of(push.motion));
    }
    slid_m /= static_cast<double>(ends.size());
    Alternative whole = summarise(ends);
    whole.X_WM = nearest_alike(piece, whole.X_WM, trial.X_WE);
    if (!options.means_only) {
      const double aside = std::hypot(noise.slide * slid_m, noise.pose.position_m);
      const double turned = std::hypot(noise.turn_rad_m * slid_m, noise.pose.heading_rad);
      whole.cov.diagonal() += Eigen::Vector3d(aside * aside, aside * aside, turned * turned);
    }
    prediction.trials.push_back({{whole}});
  }
  for (const auto& [index, pushed] : pieces) prediction.conditions += pushed.runs();
  return prediction;
}

}  // namespace

std::unique_ptr<ScenarioModel> prepare_push(const Problem& problem) {
  return std::make_unique<PushModelOfLog>(problem);
}

}  // namespace gapfarm
