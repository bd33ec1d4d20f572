#include "worker/scenarios/push/push.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/random/stream.h"
#include "worker/scenarios/push/push_piece.h"
#include "worker/scenarios/push/push_simulate.h"

namespace gapfarm {
namespace {

using Offsets = std::vector<Eigen::Vector3d>;

// Equally weighted deviations (x, y, heading) of the true start from the logged one: third-degree
// cubature of their Gaussian (Arasaratnam and Haykin 2009, sec. III).
Offsets cubature_offsets(const PoseNoise& noise) {
  const double reach = std::sqrt(3.0);
  Offsets offsets;
  for (int i = 0; i < 3; ++i) {
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    offset[i] = reach * (i < 2 ? noise.position_m : noise.heading_rad);
    offsets.push_back(offset);
    offsets.push_back(-offset);
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
};

Offsets PushModelOfLog::offsets(const PushNoise& noise, const PredictOptions& options,
                                std::uint32_t trial) const {
  if (options.means_only) return {Eigen::Vector3d::Zero()};
  if (problem_.spread.kind == SpreadKind::kCubature) return cubature_offsets(noise.pose);
  // The trial's number shares a word with the replicate's, so that trials draw independently.
  Stream stream({options.stream.run_seed(), Purpose::kEvaluation, options.stream.generation(),
                 options.stream.birth_id(),
                 options.stream.replicate() | static_cast<std::uint64_t>(trial + 1) << 32});
  Offsets drawn;
  for (unsigned i = 0; i < problem_.spread.replicates; ++i) {
    const double x = noise.pose.position_m * stream.normal();
    const double y = noise.pose.position_m * stream.normal();
    drawn.emplace_back(x, y, noise.pose.heading_rad * stream.normal());
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
  std::map<std::size_t, PushedPiece> pieces;
  std::vector<std::uint32_t> wanted(options.trials.begin(), options.trials.end());
  if (wanted.empty()) {
    for (std::uint32_t i = 0; i < problem_.log.trials.size(); ++i) wanted.push_back(i);
  }
  for (const std::uint32_t i : wanted) {
    const Trial& trial = problem_.log.trials[i];
    const Piece& piece = problem_.piece(trial.command);
    const auto index = static_cast<std::size_t>(&piece - problem_.pieces.data());
    PushedPiece& pushed = pieces.try_emplace(index, piece, index, values).first->second;
    const Pose X_WR = pushed.start_of(trial.X_WS);
    std::vector<Pose> ends;
    double slid_m = 0;
    for (const Eigen::Vector3d& o : offsets(noise, options, i)) {
      const PushedPiece::Push push = pushed.push(X_WR * Pose{o[0], o[1], o[2]}, trial.tip);
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
      MotionFacts& worst = prediction.facts[index];
      const Motion& m = push.motion;
      worst = {std::max(worst.roll_rad, m.max_roll_rad), std::max(worst.pitch_rad, m.max_pitch_rad),
               std::max(worst.heave_m, m.max_heave_m), std::max(worst.rest_time_s, m.rest_time_s)};
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
  for (const auto& [index, pushed] : pieces) {
    prediction.conditions += pushed.runs();
    prediction.simulated_s += pushed.simulated_s();
  }
  return prediction;
}

}  // namespace

std::unique_ptr<ScenarioModel> prepare_push(const Problem& problem) {
  return std::make_unique<PushModelOfLog>(problem);
}

}  // namespace gapfarm
