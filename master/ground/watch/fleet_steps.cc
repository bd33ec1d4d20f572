#include "master/ground/watch/fleet_steps.h"

#include <algorithm>

#include "common/base/ranges.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostSteps = 12;
constexpr double kLonger = 1.5;  // times as many runs, of the lengths that are looked at

// 0, and as many runs as a step may last.
std::vector<std::size_t> lengths_of(std::size_t runs) {
  std::vector<std::size_t> lengths = {0};
  for (auto length = static_cast<double>(kFewestAlike);
       length + 2.0 * kFewestAlike <= static_cast<double>(runs); length *= kLonger) {
    lengths.push_back(static_cast<std::size_t>(length));
  }
  return lengths;
}

// The best step in each of the values.
std::vector<StepCandidate> steps_in(const ScaledFleet& fleet, const RunVariances& variances) {
  std::vector<StepCandidate> best(fleet.directions.size());
  for (std::size_t k = 0; k < best.size(); ++k) best[k].value = k;
  std::vector<std::vector<std::vector<StepScore>>> stay;
  const std::vector<std::size_t> all = indices(fleet.robots.size());
  for (const std::size_t u : all) {
    const RobotRuns& robot = fleet.robots[u];
    const RobotFit fit = fit_robot(robot, variances);
    for (const std::size_t length : lengths_of(fit.residuals.size())) {
      auto scores = score_steps(fit, robot, fleet.directions, length);
      for (std::size_t k = 0; k < scores.size(); ++k) {
        for (std::size_t i = 0; i < scores[k].size(); ++i) {
          const double statistic = scores[k][i].statistic();
          if (statistic > best[k].statistic)
            best[k] = {{u}, k, robot.moments[i], statistic, length};
        }
      }
      if (length == 0) stay.push_back(std::move(scores));
    }
  }
  const PooledScores pooled = pool_scores(fleet, all, stay);
  for (std::size_t k = 0; k < best.size(); ++k) {
    for (std::size_t m = 0; m < pooled.moments.size(); ++m) {
      StepCandidate step{{}, k, pooled.moments[m], pooled.scores[k][m].statistic()};
      if (all.size() == 1 || step.statistic <= best[k].statistic) continue;
      for (const std::size_t u : all) {
        const std::size_t run = run_from(fleet.robots[u], step.moment);
        if (run < stay[u][k].size() && stay[u][k][run].precision > 0) step.robots.push_back(u);
      }
      best[k] = std::move(step);
    }
  }
  return best;
}

}  // namespace

std::size_t run_from(const RobotRuns& robot, std::size_t moment) {
  return static_cast<std::size_t>(std::ranges::lower_bound(robot.moments, moment) -
                                  robot.moments.begin());
}

PooledScores pool_scores(const ScaledFleet& fleet, const std::vector<std::size_t>& robots,
                         const std::vector<std::vector<std::vector<StepScore>>>& of_robots) {
  PooledScores pooled;
  for (const std::size_t u : robots) {
    const std::vector<std::size_t>& moments = fleet.robots[u].moments;
    pooled.moments.insert(pooled.moments.end(), moments.begin(), moments.end());
  }
  std::ranges::sort(pooled.moments);
  pooled.moments.erase(std::unique(pooled.moments.begin(), pooled.moments.end()),
                       pooled.moments.end());
  pooled.scores.assign(fleet.directions.size(), std::vector<StepScore>(pooled.moments.size()));
  for (const std::size_t u : robots) {
    for (std::size_t m = 0; m < pooled.moments.size(); ++m) {
      const std::size_t run = run_from(fleet.robots[u], pooled.moments[m]);
      for (std::size_t k = 0; k < pooled.scores.size(); ++k) {
        if (run >= of_robots[u][k].size()) continue;
        const StepScore& own = of_robots[u][k][run];
        StepScore& sum = pooled.scores[k][m];
        sum.precision += own.precision;
        if (own.precision > 0)
          sum.change += (own.change - sum.change) * own.precision / sum.precision;
      }
    }
  }
  return pooled;
}

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
  for (const std::size_t u : step.robots) {
    RobotRuns& robot = fleet->robots[u];
    const std::size_t onset = run_from(robot, step.moment);
    robot.steps.push_back({onset, direction});
    if (step.length > 0) robot.steps.push_back({onset + step.length, direction});
  }
}

std::vector<StepCandidate> best_steps(ScaledFleet* fleet, int rounds, RunVariances* variances) {
  const StepCandidate first = best_of(steps_in(*fleet, *variances));
  if (first.statistic > 0) {
    add_step(first, fleet);
    estimate_variances(&fleet->robots, variances, rounds);
    for (const std::size_t u : first.robots) {
      std::vector<StepColumn>& steps = fleet->robots[u].steps;
      steps.resize(steps.size() - (first.length > 0 ? 2 : 1));
    }
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
    found.push_back(step);
  }
  return found;
}

}  // namespace gapfarm
