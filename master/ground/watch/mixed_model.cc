#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/math/statistics.h"
#include "master/ground/watch/fleet_steps.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kRunTail = 6;
constexpr double kPriorRuns = 4;  // of the variances from run to run
// Values of runs, of the dispersion: what scatters is to be a value's own, not all values'.
constexpr double kPriorDispersion = 1e4;
constexpr int kSharedRounds = 12;
constexpr double kTail = 0.1;  // of maxima, whose excess is exponential

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd inverse(const MatrixXd& A) {
  return A.llt().solve(MatrixXd::Identity(A.rows(), A.cols()));
}

MatrixXd variance_of(const MatrixXd& covariance, const RunVariances& variances) {
  MatrixXd V = variances.dispersion * covariance;
  V.diagonal() += variances.between;
  return V;
}

bool lies_near_step(const RobotRuns& robot, const VectorXd& direction, std::size_t run) {
  return std::ranges::any_of(robot.steps, [&](const StepColumn& step) {
    return step.direction == direction &&
           std::max(run, step.onset) < std::min(run, step.onset) + kFewestAlike;
  });
}

}  // namespace

RobotFit fit_robot(const RobotRuns& robot, const RunVariances& variances) {
  const Index p = variances.between.size();
  const Index q = p + static_cast<Index>(robot.steps.size());
  RobotFit fit;
  MatrixXd N = MatrixXd::Zero(q, q);
  VectorXd b = VectorXd::Zero(q);
  for (std::size_t i = 0; i < robot.values.size(); ++i) {
    MatrixXd X = MatrixXd::Zero(p, q);
    X.leftCols(p).setIdentity();
    for (std::size_t s = 0; s < robot.steps.size(); ++s) {
      if (i >= robot.steps[s].onset) X.col(p + static_cast<Index>(s)) = robot.steps[s].direction;
    }
    MatrixXd A = robot.weights[i] * inverse(variance_of(robot.covariances[i], variances));
    N += X.transpose() * A * X;
    b += X.transpose() * (A * robot.values[i]);
    fit.precisions.push_back(std::move(A));
    fit.designs.push_back(std::move(X));
  }
  fit.covariance = inverse(N);
  fit.beta = fit.covariance * b;
  for (std::size_t i = 0; i < robot.values.size(); ++i) {
    fit.residuals.push_back(robot.values[i] - fit.designs[i] * fit.beta);
  }
  return fit;
}

void estimate_variances(std::vector<RobotRuns>* robots, RunVariances* at, int rounds) {
  const Index p = at->between.size();
  const auto size = static_cast<double>(p);
  for (int round = 0; round < rounds; ++round) {
    double runs = 0, own = 0;
    VectorXd between = VectorXd::Zero(p);
    for (RobotRuns& robot : *robots) {
      const RobotFit fit = fit_robot(robot, *at);
      for (std::size_t i = 0; i < robot.values.size(); ++i) {
        const double u = robot.weights[i];
        const MatrixXd A = fit.precisions[i] / u;
        const MatrixXd& C = robot.covariances[i];
        const VectorXd a = A * fit.residuals[i];
        // A less what the robot's own values take up: the restricted likelihood's.
        const MatrixXd AX = A * fit.designs[i];
        const MatrixXd rest = A - u * AX * fit.covariance * AX.transpose();
        const VectorXd w = at->between.cwiseProduct(a);
        between += u * w.cwiseProduct(w) + at->between -
                   at->between.cwiseProduct(at->between).cwiseProduct(rest.diagonal());
        const double f = at->dispersion;
        own += u * f * f * a.dot(C * a) + f * size - f * f * rest.cwiseProduct(C).sum();
        runs += 1;
        robot.weights[i] = (kRunTail + size) / (kRunTail + fit.residuals[i].dot(a));
      }
    }
    at->between = (between + kPriorRuns * at->prior) / (runs + kPriorRuns);
    at->dispersion = (own + kPriorDispersion) / (runs * size + kPriorDispersion);
  }
}

std::vector<std::vector<StepScore>> score_steps(const RobotFit& fit, const RobotRuns& robot,
                                                const std::vector<VectorXd>& directions,
                                                std::size_t length, std::size_t fewest) {
  const std::size_t n = robot.values.size();
  std::vector<std::vector<StepScore>> scores(directions.size(), std::vector<StepScore>(n));
  const Index p = n == 0 ? 0 : fit.precisions[0].rows();
  MatrixXd weight = MatrixXd::Zero(p, p), shared = MatrixXd::Zero(fit.beta.size(), p);
  VectorXd pull = VectorXd::Zero(p);
  const auto count = [&](std::size_t run, double sign) {
    weight += sign * fit.precisions[run];
    shared += sign * fit.designs[run].transpose() * fit.precisions[run];
    pull += sign * fit.precisions[run] * fit.residuals[run];
  };
  for (std::size_t i = n; i-- > 0;) {
    count(i, 1);
    if (length > 0 && i + length < n) count(i + length, -1);
    if (n - i < fewest + length || i < fewest) continue;
    for (std::size_t k = 0; k < directions.size(); ++k) {
      const VectorXd& d = directions[k];
      if (lies_near_step(robot, d, i) || (length > 0 && lies_near_step(robot, d, i + length)))
        continue;
      const VectorXd taken = shared * d;
      const double alone = d.dot(weight * d);
      const double precision = alone - taken.dot(fit.covariance * taken);
      if (precision <= 1e-9 * alone) continue;
      scores[k][i] = {d.dot(pull) / precision, precision};
    }
  }
  return scores;
}

Shared estimate_shared(const std::vector<RobotFit>& fits, const VectorXd& prior, int skipped) {
  const Index p = prior.size();
  std::vector<RobotRuns> robots(1);
  for (std::size_t u = 0; u < fits.size(); ++u) {
    if (static_cast<int>(u) == skipped) continue;
    robots[0].values.emplace_back(fits[u].beta.head(p));
    robots[0].covariances.emplace_back(fits[u].covariance.topLeftCorner(p, p));
  }
  robots[0].weights.assign(robots[0].values.size(), 1);
  RunVariances variances{1, prior};
  estimate_variances(&robots, &variances, kSharedRounds);
  const RobotFit fit = fit_robot(robots[0], variances);
  return {fit.beta, fit.covariance, variances.between};
}

double threshold_of(const std::vector<double>& maxima, double alarms) {
  const double from = quantile(maxima, 1 - std::max(kTail, alarms));
  if (alarms >= kTail) return from;
  const auto excess = filtered(mapped(maxima, [&](double m) { return m - from; }),
                               [](double beyond) { return beyond > 0; });
  return from + mean(excess) * std::log(kTail / alarms);
}

}  // namespace gapfarm
