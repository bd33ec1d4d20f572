// The mixed model behind find_changes(): values of runs in tolerances, by least squares.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "master/infer/settings.h"

namespace gapfarm {

// A column of a robot's design: from run `onset` on its values are moved along the direction.
struct StepColumn {
  std::size_t onset = 0;
  Eigen::VectorXd direction;
};

struct RobotRuns {
  std::vector<Eigen::VectorXd> values;
  std::vector<Eigen::MatrixXd> covariances;
  std::vector<double> weights = {};  // of each run: runs that are far off count little
  std::vector<StepColumn> steps = {};
  std::vector<std::size_t> moments =
      {};  // of each run, ascending: its place among all robots' runs
};

struct RunVariances {
  double dispersion = 1;    // of the covariances
  Eigen::VectorXd between;  // from run to run, beside them
  Eigen::VectorXd prior = between;
};

// One robot by generalised least squares.
struct RobotFit {
  Eigen::VectorXd beta;  // what it owns, then how far each step goes
  Eigen::MatrixXd covariance;
  std::vector<Eigen::MatrixXd> precisions;  // of each run, weighted
  std::vector<Eigen::MatrixXd> designs;     // of each run
  std::vector<Eigen::VectorXd> residuals;   // of each run
};
RobotFit fit_robot(const RobotRuns& robot, const RunVariances& variances);

// Maximum a posteriori by EM, from where both stand: runs scatter with Student's density of
// kRunTail degrees of freedom, whose weights are left in the robots; restricted likelihood, a prior
// of a few runs and, of the dispersion, of 1.
void estimate_variances(std::vector<RobotRuns>* robots, RunVariances* at, int rounds);
inline constexpr double kRunTail = 6;

// The step in this direction at this run that the fit would gain most of; back after `length` runs,
// 0: never.
struct StepScore {
  double change = 0;
  double precision = 0;  // of the change
  double statistic() const { return change * change * precision; }
};
// [direction][onset]; nothing (precision 0) where fewer than kFewestAlike runs lie on a side, or
// between it and another of the robot's steps in this direction.
std::vector<std::vector<StepScore>> score_steps(const RobotFit& fit, const RobotRuns& robot,
                                                const std::vector<Eigen::VectorXd>& directions,
                                                std::size_t length = 0);

// What robots share, and differ by, as runs of one robot do.
struct Shared {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;  // of the mean
  Eigen::VectorXd between;     // variances from robot to robot
};
// `skipped`: a robot that is not among them; -1: all are.  `prior`: variances of robots of a kind.
Shared estimate_shared(const std::vector<RobotFit>& fits, const Eigen::VectorXd& prior,
                       int skipped);

// What a share `alarms` of such maxima exceed, by the exponential tail of the highest tenth where
// it is less than that.
double threshold_of(const std::vector<double>& maxima, double alarms);

}  // namespace gapfarm
