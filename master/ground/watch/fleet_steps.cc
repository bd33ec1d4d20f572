#include "master/ground/watch/fleet_steps.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/math/laws.h"
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
  std::vector<StepCandidate> best = mapped(indices(fleet.directions.size()), [](std::size_t k) {
    return StepCandidate{{}, k};
  });
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

using Eigen::VectorXd;

// The smallest span of runs that holds these shares' 90 % best.
std::pair<std::size_t, std::size_t> span_of(const std::vector<double>& shares) {
  const std::vector<std::size_t> order = order_of(shares, std::greater());
  std::pair<std::size_t, std::size_t> span = {order[0], order[0]};
  double held = 0;
  for (const std::size_t i : order) {
    span = {std::min(span.first, i), std::max(span.second, i)};
    held += shares[i];
    if (held >= 0.9) break;
  }
  return span;
}

// What the robots' value is before a step, on average.
double value_before(const WatchedRows& rows, ScaledFleet fleet, const RunVariances& variances,
                    const StepCandidate& step) {
  add_step(step, &fleet);
  return sum_of(step.robots, [&](std::size_t u) {
    const RobotFit fit = fit_robot(fleet.robots[u], variances);
    const Eigen::MatrixXd& design = fit.designs[run_from(fleet.robots[u], step.moment) - 1];
    const VectorXd values = (design * fit.beta).cwiseProduct(tolerances_of(rows));
    return value_at(rows, step.value, values) / static_cast<double>(step.robots.size());
  });
}

// No value falls below its least one; what is a ratio to the file becomes one to what was before.
void relate_to_before(const WatchedValue& value, double before, ValueStep* step) {
  for (double* of : {&step->change, &step->lo, &step->hi}) {
    if (before > value.least) *of = std::max(*of, value.least - before);
    if (value.unit == "-" && before > 0) *of /= before;
  }
}

// What is put right, with the length that fits best: few are tried.
StepCandidate with_best_length(const ScaledFleet& fleet, const RunVariances& variances,
                               StepCandidate step) {
  const RobotRuns& robot = fleet.robots[step.robots.front()];
  const RobotFit fit = fit_robot(robot, variances);
  double best = 0;
  for (std::size_t length = kFewestAlike; step.length > 0 && length < robot.values.size();
       ++length) {
    const auto scores = score_steps(fit, robot, {fleet.directions[step.value]}, length);
    for (const StepScore& s : scores.front()) {
      if (s.statistic() <= best) continue;
      best = s.statistic();
      step.length = length;
    }
  }
  return step;
}

// A step by its posterior over values and onsets, all equally likely before and its size normal
// round nothing; the robots' other steps are in the fit.  Of all robots those are kept whose own
// size is nearer to the shared one than to none.  One that is put right is two, of one size.
void describe_step(const WatchedRows& rows, const ScaledFleet& fleet, const RunVariances& variances,
                   StepCandidate found, std::vector<ValueStep>* steps) {
  const std::vector<RobotFit> fits = fit_robots(fleet, variances);
  std::vector<std::vector<std::vector<StepScore>>> of_robots;
  for (std::size_t u = 0; u < fits.size(); ++u) {
    // That there is a step was found among those with more runs on either side.
    of_robots.push_back(score_steps(fits[u], fleet.robots[u], fleet.directions, found.length, 1));
  }
  const auto [moments, scores] = pool_scores(fleet, found.robots, of_robots);
  std::vector<std::vector<double>> weights;
  ValueStep step;
  step.robots = found.robots;
  for (std::size_t k = 0; k < scores.size(); ++k) {
    weights.push_back(mapped(scores[k], [&](const StepScore& s) {
      const double known = s.precision * rows.values[k].plausible * rows.values[k].plausible;
      const double nats =
          s.statistic() * known / (1 + known) / 2 - std::log1p(known) / 2 - found.statistic / 2;
      return s.precision > 0 ? std::exp(nats) : 0;
    }));
    step.shares.push_back(sum_of(weights[k], std::identity()));
  }
  const double all = sum_of(step.shares, std::identity());
  for (double& share : step.shares) share /= all;
  step.value = std::ranges::max_element(step.shares) - step.shares.begin();
  std::vector<double>& onsets = weights[step.value];
  for (double& w : onsets) w /= all * step.shares[step.value];
  double squares = 0;
  for (std::size_t i = 0; i < onsets.size(); ++i) {
    const StepScore& s = scores[step.value][i];
    if (onsets[i] <= 0) continue;
    step.change += onsets[i] * s.change;
    squares += onsets[i] * (s.change * s.change + 1 / s.precision);
    step.statistic = std::max(step.statistic, s.statistic());
  }
  const double half = kNormal90 * std::sqrt(std::max(0.0, squares - step.change * step.change));
  step.lo = step.change - half;
  step.hi = step.change + half;
  const std::size_t moment = moments[std::ranges::max_element(onsets) - onsets.begin()];
  std::erase_if(found.robots, [&](std::size_t u) {
    const std::vector<StepScore>& own = of_robots[u][step.value];
    const std::size_t run = run_from(fleet.robots[u], moment);
    return run >= own.size() || own[run].change / step.change < 0.5;
  });
  if (!found.robots.empty() && found.robots.size() < step.robots.size())
    return describe_step(rows, fleet, variances, std::move(found), steps);
  const RobotRuns& first = fleet.robots[step.robots.front()];
  const auto [from, to] = span_of(onsets);
  step.onset = run_from(first, moment);
  step.onset_first = run_from(first, moments[from]);
  step.onset_last = std::min(run_from(first, moments[to]), first.values.size() - 1);
  const double before = value_before(
      rows, fleet, variances, {step.robots, step.value, moment, step.statistic, found.length});
  ValueStep back = step;
  relate_to_before(rows.values[step.value], before, &step);
  steps->push_back(step);
  if (found.length == 0) return;
  const double moved = back.change;
  for (std::size_t* of : {&back.onset, &back.onset_first, &back.onset_last}) *of += found.length;
  std::tie(back.change, back.lo, back.hi) = std::tuple(-moved, -back.hi, -back.lo);
  relate_to_before(rows.values[step.value], before + moved, &back);
  steps->push_back(back);
}

}  // namespace

std::size_t run_from(const RobotRuns& robot, std::size_t moment) {
  return static_cast<std::size_t>(std::ranges::lower_bound(robot.moments, moment) -
                                  robot.moments.begin());
}

PooledScores pool_scores(const ScaledFleet& fleet, const std::vector<std::size_t>& robots,
                         const std::vector<std::vector<std::vector<StepScore>>>& of_robots) {
  PooledScores pooled;
  for (const std::size_t u : robots) append(pooled.moments, fleet.robots[u].moments);
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

VectorXd tolerances_of(const WatchedRows& rows) {
  return vector_of(rows.rows, &KinematicRow::tolerance);
}

double value_at(const WatchedRows& rows, std::size_t value, const VectorXd& values) {
  const VectorXd& among = rows.values[value].direction;
  const VectorXd away = values - vector_of(rows.rows, &KinematicRow::nominal);
  return rows.values[value].nominal + among.dot(away) / among.squaredNorm();
}

std::vector<RobotFit> fit_robots(const ScaledFleet& fleet, const RunVariances& variances) {
  return mapped(fleet.robots, [&](const RobotRuns& robot) { return fit_robot(robot, variances); });
}

std::vector<ValueStep> describe_steps(const WatchedRows& rows, const ScaledFleet& fleet,
                                      const RunVariances& variances,
                                      const std::vector<StepCandidate>& found) {
  std::vector<ValueStep> steps;
  for (std::size_t s = 0; s < found.size(); ++s) {
    ScaledFleet without = fleet;
    for (RobotRuns& robot : without.robots) robot.steps.clear();
    for (std::size_t t = 0; t < found.size(); ++t) {
      if (t != s) add_step(found[t], &without);
    }
    describe_step(rows, without, variances, with_best_length(without, variances, found[s]), &steps);
  }
  std::ranges::stable_sort(
      steps, {}, [](const ValueStep& step) { return std::pair(step.robots.front(), step.onset); });
  return steps;
}

}  // namespace gapfarm
