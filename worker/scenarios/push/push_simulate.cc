#include "worker/scenarios/push/push_simulate.h"

#include <map>

#include "common/random/stream.h"
#include "worker/scenarios/push/push_piece.h"

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
    double simulated_s = 0;
    for (const auto& [name, piece] : pieces_) simulated_s += piece.simulated_s();
    result.set_simulated(simulated_s);
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
    Stream stream({task_.stream().run_seed(), Purpose::kSimulation, task_.stream().generation(),
                   task_.stream().birth_id(), static_cast<std::uint64_t>(i)});
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
    const double x = X_WM.x + noise_.pose.position_m * stream.normal();
    const double y = X_WM.y + noise_.pose.position_m * stream.normal();
    return {x, y, wrap_angle(X_WM.theta + noise_.pose.heading_rad * stream.normal())};
  }

  const Problem& problem_;
  const ParameterValues& values_;
  const v1::SimulateTask& task_;
  StepCounter* steps_;
  PushNoise noise_;
  std::map<std::string, PushedPiece> pieces_;
};

}  // namespace

v1::TaskResult simulate_pushes(const Problem& problem, const ParameterValues& values,
                               const v1::SimulateTask& task, StepCounter* steps) {
  return PushSession(problem, values, task, steps).run();
}

v1::TaskResult trace_push(const Problem& problem, const ParameterValues& values,
                          const v1::TraceTask& task, StepCounter* steps) {
  v1::TaskResult result;
  if (task.trial() >= problem.log.trials.size()) {
    result.set_outcome(v1::INVALID_REQUEST);
    result.set_message("trial " + std::to_string(task.trial()) +
                       " is to be traced, and the log has " +
                       std::to_string(problem.log.trials.size()) + " pushes");
    return result;
  }
  const Trial& trial = problem.log.trials[task.trial()];
  const Piece& piece = problem.piece(trial.command);
  PushedPiece pushed(piece, static_cast<std::size_t>(&piece - problem.pieces.data()), values);
  Pose X_WR = pushed.start_of(trial.X_WS);
  if (task.noisy()) {
    const PushNoise noise = push_noise(values);
    Stream stream({task.stream().run_seed(), Purpose::kSimulation, task.stream().generation(),
                   task.stream().birth_id(), task.stream().replicate()});
    const double x = noise.pose.position_m * stream.normal();
    const double y = noise.pose.position_m * stream.normal();
    X_WR = X_WR * Pose{x, y, noise.pose.heading_rad * stream.normal()};
  }
  std::vector<PathSample> path;
  const PushedPiece::Push push = pushed.push(X_WR, trial.tip, &path, task.interval());
  count_step(steps);
  result.set_outcome(push.outcome);
  result.set_simulated(pushed.simulated_s());
  for (const PathSample& s : path) {
    v1::TraceSample* sample = result.mutable_trace()->add_samples();
    sample->set_t(s.t_s);
    *sample->mutable_pose() = to_proto(s.pose);
  }
  return result;
}

}  // namespace gapfarm
