#include "worker/scenarios/windows.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/parameters/ground.h"
#include "common/score/fitness.h"

namespace gapfarm {
namespace {

constexpr double kPathPoint_s = 0.1;  // between poses along which noise adds up

struct DriftNoise {
  double travel = 0;  // m / sqrt(m)
  double turn = 0;    // rad / sqrt(m)
};

// A random walk along the way: every stretch of wheel travel ds adds variances travel^2 ds and
// turn^2 ds.  In the axes of the last pose.
Eigen::Matrix3d drift(std::span<const GroundSample> path, const DriftNoise& noise) {
  Eigen::Matrix3d D = Eigen::Matrix3d::Zero();
  for (std::size_t k = 1; k < path.size(); ++k) {
    const double ds = path[k].travel_m - path[k - 1].travel_m;
    const double along = noise.travel * noise.travel * ds;
    const Eigen::Matrix3d J = carry(between(path[k].X_SR, path.back().X_SR));
    D += J * Eigen::Vector3d(along, along, noise.turn * noise.turn * ds).asDiagonal() *
         J.transpose();
  }
  return D;
}

}  // namespace

WindowModel::WindowModel(const Problem& problem) : problem_(problem), times_(problem.runs.size()) {
  for (const Trial& trial : problem.log.trials) {
    const double end = *trial.t_s + *trial.duration_s;
    std::vector<double>& times = times_[*trial.run];
    const long points = std::max(1L, std::lround(*trial.duration_s / kPathPoint_s));
    for (long k = 0; k < points; ++k) {
      times.push_back(*trial.t_s +
                      *trial.duration_s * static_cast<double>(k) / static_cast<double>(points));
    }
    times.push_back(end);
  }
  for (std::vector<double>& times : times_) {
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
  }
}

double WindowModel::at(const ParameterValues& values, const char* key) const {
  return values[problem_.table().row(key)];
}

// From the simulated way to the logged end pose of the marker, with the noise of both readings.
TrialPrediction WindowModel::observe(const ParameterValues& values, const Pose& X_RM,
                                     const GroundMotion& motion, const Trial& trial,
                                     bool means_only) const {
  const auto& samples = motion.samples;
  const auto index = [&](double t) {
    const auto found = std::ranges::lower_bound(samples, t, {}, &GroundSample::t_s);
    return static_cast<std::size_t>(found - samples.begin());
  };
  const std::size_t from = index(*trial.t_s);
  const std::size_t to = index(*trial.t_s + *trial.duration_s);
  const Pose X_SE = between(samples[from].X_SR, samples[to].X_SR);
  const Pose X_MM = inverse(X_RM) * X_SE * X_RM;
  Alternative end{1, trial.X_WS * X_MM, Eigen::Matrix3d::Zero()};
  if (means_only) return {{end}};
  const DriftNoise noise{at(values, kGroundTravelNoise), at(values, kGroundTurnNoise)};
  const PoseNoise reading{at(values, kGroundPositionNoise), at(values, kGroundHeadingNoise)};
  // From the robot's axes at the end to the marker's.
  const Eigen::Matrix3d J = carry(X_RM);
  const std::span<const GroundSample> path(samples.data() + from, to - from + 1);
  end.cov = predictive_covariance(X_MM, J * drift(path, noise) * J.transpose(), reading);
  return {{end}};
}

Prediction WindowModel::predict(const ParameterValues& values,
                                const PredictOptions& options) const {
  Prediction prediction;
  prediction.facts.resize(problem_.commands.size());
  const WindowRobot robot = robot_at(values, options);
  std::map<std::uint32_t, GroundMotion> motions;
  for (const std::uint32_t i : options.of(problem_.log.trials.size())) {
    const Trial& trial = problem_.log.trials[i];
    const auto [entry, fresh] = motions.try_emplace(*trial.run);
    GroundMotion& motion = entry->second;
    if (fresh) {
      const CommandedRun& run = problem_.runs[*trial.run];
      // Of the robot's own origin; the marker beside it moves with the turn.
      const double ahead = run.speed_m_s + run.turn_rad_s * robot.X_RM.y;
      motion =
          robot.run(run.commands, {run.start_s, {ahead, 0, run.turn_rad_s}}, times_[*trial.run]);
      ++prediction.conditions;
      prediction.facts.front().include(
          {motion.max_roll_rad, motion.max_pitch_rad, motion.max_heave_m, 0});
      if (motion.outcome != MotionOutcome::kOk) {
        prediction.outcome = to_outcome(motion.outcome);
        prediction.message = "run of session " + trial.session;
        if (!motion.message.empty()) prediction.message += ": " + motion.message;
        prediction.trials.clear();
        return prediction;
      }
    }
    prediction.trials.push_back(observe(values, robot.X_RM, motion, trial, options.means_only));
  }
  return prediction;
}

}  // namespace gapfarm
