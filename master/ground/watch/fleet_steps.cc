#include "master/ground/watch/fleet_steps.h"

#include <algorithm>

namespace gapfarm {
namespace {

constexpr std::size_t kMostSteps = 12;
constexpr double kLonger = 1.5;  // times as many runs, of the lengths that are looked at

// 0, and as many runs as a step may last.
std::vector<std::size_t> lengths_of(std::size_t runs) {
  std::vector<std::size_t> lengths = {0};
  for (auto length = static_cast<double>(kLeastRuns);
       length + 2.0 * kLeastRuns <= static_cast<double>(runs); length *= kLonger) {
    lengths.push_back(static_cast<std::size_t>(length));
  }
  return lengths;
}

// The best step in each of the values.
std::vector<StepCandidate> steps_in(const ScaledFleet& fleet, const RunVariances& variances) {
  std::vector<StepCandidate> best(fleet.directions.size());
  for (std::size_t k = 0; k < best.size(); ++k) best[k].value = k;
  for (std::size_t u = 0; u < fleet.robots.size(); ++u) {
    const RobotFit fit = fit_robot(fleet.robots[u], variances);
    for (const std::size_t length : lengths_of(fit.residuals.size())) {
      const auto scores = score_steps(fit, fleet.robots[u], fleet.directions, length);
      for (std::size_t k = 0; k < scores.size(); ++k) {
        for (std::size_t i = 0; i < scores[k].size(); ++i) {
          const double statistic = scores[k][i].statistic();
          if (statistic > best[k].statistic) best[k] = {u, k, i, statistic, length};
        }
      }
    }
  }
  return best;
}

}  // namespace

StepCandidate best_of(const std::vector<StepCandidate>& steps,
                      const std::vector<double>& thresholds) {
  const auto beyond = [&](const StepCandidate& step) {
    return step.statistic - (thresholds.empty() ? 0 : thresholds[step.value]);
  };
  return *std::ranges::max_element(
      steps, [&](const StepCandidate& a, const StepCandidate& b) { return beyond(a) < beyond(b); });
}

void add_step(const StepCandidate& step, ScaledFleet* fleet) {
  const Eigen::VectorXd& direction = fleet->directions[step.value];
  std::vector<StepColumn>& steps = fleet->robots[step.robot].steps;
  steps.push_back({step.onset, direction});
  if (step.length > 0) steps.push_back({step.onset + step.length, direction});
}

std::vector<StepCandidate> best_steps(ScaledFleet* fleet, int rounds, RunVariances* variances) {
  const StepCandidate first = best_of(steps_in(*fleet, *variances));
  if (first.statistic > 0) {
    std::vector<StepColumn>& steps = fleet->robots[first.robot].steps;
    const std::size_t before = steps.size();
    add_step(first, fleet);
    estimate_variances(&fleet->robots, variances, rounds);
    steps.resize(before);
  }
  return steps_in(*fleet, *variances);
}

std::vector<StepCandidate> add_steps_beyond(const std::vector<double>& thresholds,
                                            ScaledFleet* fleet, RunVariances* variances) {
  std::vector<StepCandidate> found;
  while (found.size() < kMostSteps) {
    const StepCandidate step = best_of(best_steps(fleet, kEstimateRounds, variances), thresholds);
    if (step.statistic <= thresholds[step.value]) break;
    add_step(step, fleet);
    found.push_back({step.robot, step.value, step.onset, step.statistic});
    if (step.length > 0) {
      found.push_back({step.robot, step.value, step.onset + step.length, step.statistic});
    }
  }
  return found;
}

}  // namespace gapfarm
