// Steps that were found, by what they are and since when.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "master/ground/watch/changes.h"
#include "master/ground/watch/fleet_steps.h"
#include "master/ground/watch/mixed_model.h"

namespace gapfarm {

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
