#include "master/diagnose/evidence/residuals.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/math/statistics.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kFarGap_m = 0.05, kFarGap_rad = 0.35;  // farther is no rounding

double squared(double v) { return v * v; }

// s.d. of values that may hold outliers: the plain one where their tails are normal.
double spread(const std::vector<double>& values, double heaviest_kurtosis) {
  double second = 0, fourth = 0;
  for (double v : values) {
    second += squared(v) / static_cast<double>(values.size());
    fourth += squared(squared(v)) / static_cast<double>(values.size());
  }
  if (second <= 0) return 0;
  if (fourth / squared(second) < heaviest_kurtosis) return std::sqrt(second);
  return median_deviation(values);
}

// s.d. of a reading whose differences from another of the same these are.  On a grid most may be
// zero, where a median says nothing.
double one_of_two(std::vector<double> gaps, double quantum, double far, double heaviest_kurtosis) {
  if (quantum <= 0) return spread(gaps, heaviest_kurtosis) / std::numbers::sqrt2;
  for (double& gap : gaps) gap = std::clamp(gap, -far, far);
  return std::max(spread(gaps, INFINITY) / std::numbers::sqrt2, quantum / std::sqrt(12.0));
}

// How far from its start a motion leads, over its way; below 0 in every second round.
double led_by(double turn_rad) {
  return std::abs(turn_rad) < 1e-4 ? 1 : 2 * std::sin(turn_rad / 2) / turn_rad;
}

// The motion that is predicted to end there; none of pushes, and where one that turns by so much
// more leads otherwise far, as near a whole turn.
std::optional<Twist> motion_to(const ResidualTrial& trial, const Pose& X_WP, double more_rad) {
  constexpr double kOtherwise = 2;
  if (of_gain(trial).isZero(0)) return std::nullopt;
  const Pose X_SP = between(trial.X_WS, X_WP);
  // What the sides do to a heading says how many times it went round.
  constexpr double kTwoPi = 2 * std::numbers::pi;
  const double turn = X_SP.theta + kTwoPi * std::round((of_gain(trial)[2] - X_SP.theta) / kTwoPi);
  const double ratio = led_by(turn + more_rad) / led_by(turn);
  if (!(ratio > 1 / kOtherwise && ratio < kOtherwise)) return std::nullopt;
  return log(X_SP, turn);
}

}  // namespace

Eigen::Vector3d difference_of(const ResidualTrial& trial, const Pose& X_WP, const Pose& X_WE) {
  const Eigen::Vector3d chord = local_difference(X_WP, X_WE);
  const auto motion = motion_to(trial, X_WP, chord[2]);
  if (!motion) return chord;
  const Twist moved = log(between(trial.X_WS, X_WE), (*motion)[2] + chord[2]);
  return end_slopes(*motion) * (moved - *motion);
}

Eigen::Vector3d residual_of(const ResidualTrial& trial, const Pose& X_WP) {
  return difference_of(trial, X_WP, trial.X_WE) - trial.late;
}

Pose end_with(const ResidualTrial& trial, const Pose& X_WP, const Eigen::Vector3d& residual) {
  const auto motion = motion_to(trial, X_WP, residual[2]);
  if (!motion) return X_WP * Pose{residual[0], residual[1], residual[2]};
  return trial.X_WS * exp(*motion + end_slopes(*motion).inverse() * residual);
}

Eigen::Matrix3d reading_covariance(const ResidualTrial& trial, const PoseNoise& noise) {
  return predictive_covariance(between(trial.X_WS, trial.X_WP), Eigen::Matrix3d::Zero(), noise);
}

Eigen::Matrix3d trial_covariance(const ResidualTrial& trial, const NoiseEstimate& noise) {
  const Eigen::Vector3d both = trial.left + trial.right;
  const double c2 = noise.drive_common * noise.drive_common;
  const double s2 = noise.drive_side * noise.drive_side;
  return reading_covariance(trial, noise.pose) + c2 * both * both.transpose() +
         s2 * (trial.left * trial.left.transpose() + trial.right * trial.right.transpose());
}

std::vector<ReadingGap> reading_gaps(const TrialLog& log,
                                     const std::vector<TrialContext>& contexts) {
  std::vector<ReadingGap> gaps;
  for (std::size_t i = 0; i < log.trials.size(); ++i) {
    if (contexts[i].moved || !contexts[i].previous) continue;
    const std::size_t before = *contexts[i].previous;
    gaps.push_back({i, before, local_difference(log.trials[before].X_WE, log.trials[i].X_WS)});
  }
  return gaps;
}

std::vector<ReadingGap> late_reading_gaps(const std::vector<ResidualTrial>& trials,
                                          const std::vector<Eigen::Vector3d>& end_velocity,
                                          const PoseNoise& noise) {
  const Eigen::Vector3d sd =
      std::sqrt(2.0) * Eigen::Vector3d(noise.position_m, noise.position_m, noise.heading_rad);
  std::vector<ReadingGap> gaps;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const TrialContext& context = trials[i].context;
    if (!context.previous) continue;
    const std::size_t before = *context.previous;
    const ReadingGap gap{i, before, local_difference(trials[before].X_WE, trials[i].X_WS)};
    const Eigen::Vector3d per_second = end_velocity[before].cwiseQuotient(sd);
    const Eigen::Vector3d z = gap.gap.cwiseQuotient(sd);
    const double age = std::clamp(z.dot(per_second) / std::max(per_second.squaredNorm(), 1e-12),
                                  0.0, kOldestReading_s);
    const bool late = (z - age * per_second).cwiseAbs().maxCoeff() < kOutlierDeviations;
    if (!context.moved || late) gaps.push_back(gap);
  }
  return gaps;
}

PoseNoise reading_noise(std::span<const ReadingGap> gaps, const PoseGrid& grid) {
  if (gaps.size() < kFewestReadings) return {0, 0};
  std::vector<double> position, heading;
  std::size_t shared = 0;
  for (const ReadingGap& g : gaps) {
    if (g.gap.isZero(1e-12)) ++shared;
    position.insert(position.end(), {g.gap[0], g.gap[1]});
    heading.push_back(g.gap[2]);
  }
  // On a coarse grid positions repeat, or headings do, but not both.
  if (2 * shared > gaps.size()) return {0, 0};
  return {std::max(1e-4, one_of_two(std::move(position), grid.step_m, kFarGap_m, kHeavyTails)),
          std::max(1e-3, one_of_two(std::move(heading), grid.heading_step_rad, kFarGap_rad,
                                    kHeavyHeading))};
}

}  // namespace gapfarm
