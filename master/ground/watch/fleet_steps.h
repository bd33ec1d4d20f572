// The steps in a fleet that its runs show best, and what they are and since when.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "master/ground/watch/changes.h"
#include "master/ground/watch/mixed_model.h"

namespace gapfarm {

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
