// The mixed model behind find_changes(): values of runs in tolerances, by least squares, and the
// steps in a fleet that its runs show best, what they are and since when.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "master/ground/watch/changes.h"

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

// Maximum a posteriori by EM, from where both stand: runs scatter with Student's density of 6
// degrees of freedom, whose weights are left in the robots; restricted likelihood, a prior of a few
// runs and, of the dispersion, of 1.
void estimate_variances(std::vector<RobotRuns>* robots, RunVariances* at, int rounds);

// The step in this direction at this run that the fit would gain most of; back after `length` runs,
// 0: never.
struct StepScore {
  double change = 0;
  double precision = 0;  // of the change
  double statistic() const { return change * change * precision; }
};
// [direction][onset]; nothing (precision 0) where fewer than `fewest` runs lie on a side, or fewer
// than kFewestAlike between it and another of the robot's steps in this direction.
std::vector<std::vector<StepScore>> score_steps(const RobotFit& fit, const RobotRuns& robot,
                                                const std::vector<Eigen::VectorXd>& directions,
                                                std::size_t length = 0,
                                                std::size_t fewest = kFewestAlike);

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

inline constexpr int kEstimateRounds = 40;  // of EM, from the priors

// At one moment in one robot, or of one size in all that have runs enough on either side.
struct StepCandidate {
  std::vector<std::size_t> robots;
  std::size_t value = 0, moment = 0;
  double statistic = 0;
  std::size_t length = 0;  // runs, after which it is back; 0: it stays
};

// The fleet in tolerances.
struct ScaledFleet {
  std::vector<RobotRuns> robots;
  std::vector<Eigen::VectorXd> directions;
  Eigen::VectorXd owned;  // variances
};

// Scores of steps of one size in these robots, [value][moment].
struct PooledScores {
  std::vector<std::size_t> moments;  // at which one of them has a run
  std::vector<std::vector<StepScore>> scores;
};
// `of_robots`: scores of each robot's steps, [robot][value][run].
PooledScores pool_scores(const ScaledFleet& fleet, const std::vector<std::size_t>& robots,
                         const std::vector<std::vector<std::vector<StepScore>>>& of_robots);
// The first run from a moment on.
std::size_t run_from(const RobotRuns& robot, std::size_t moment);

// Of steps in each value the one that is farthest beyond its threshold; none: all are 0.
StepCandidate best_of(const std::vector<StepCandidate>& steps,
                      const std::vector<double>& thresholds = {});

void add_step(const StepCandidate& step, ScaledFleet* fleet);

// The best step in each of the values, where variances and weights do not count the best one of all
// as scatter; both are left so.  What changes and is put right again is one candidate: of the two
// steps neither need show without the other.
std::vector<StepCandidate> best_steps(ScaledFleet* fleet, int rounds, RunVariances* variances);

// Steps beyond the thresholds, each sought beside the ones before; they are left in the fleet.
std::vector<StepCandidate> add_steps_beyond(const std::vector<double>& thresholds,
                                            ScaledFleet* fleet, RunVariances* variances);

// What a ScaledFleet counts in.
Eigen::VectorXd tolerances_of(const WatchedRows& rows);

// Of a value what these values of a run are, all others its robot's own.
double value_at(const WatchedRows& rows, std::size_t value, const Eigen::VectorXd& values);

std::vector<RobotFit> fit_robots(const ScaledFleet& fleet, const RunVariances& variances);

// Steps as all that was found describes them, each beside the others.
std::vector<ValueStep> describe_steps(const WatchedRows& rows, const ScaledFleet& fleet,
                                      const RunVariances& variances,
                                      const std::vector<StepCandidate>& found);

}  // namespace gapfarm
