// How much the drive varies, from what no smooth function of the covariates explains.
#pragma once

#include <vector>

#include "master/diagnose/evidence/covariates.h"
#include "master/diagnose/fit/regression.h"

namespace gapfarm {

// Leftover residuals with their degrees of freedom given back: three whitened rows a trial.
Eigen::VectorXd studentised(const Regression& explained, double least_freedom);

// A trial that lies beyond `most` standard deviations of what no smooth function explains is
// trusted only so far: its distance counts as `most`.  A push that slips off a corner is no
// evidence of anything else.
void bound_far_trials(const std::vector<Eigen::Vector3d>& residuals, double most, Study* study);

// Sets the study's drive noise (and the readings' too, when the log shares one reading between
// trials), so that an effect that is not yet named does not pass for noise.  Returns what nothing
// smooth explains of every trial (m, m, rad).
std::vector<Eigen::Vector3d> estimate_noise(const Regression& nuisances,
                                            const std::vector<CovariateBlock>& blocks,
                                            Study* study);

}  // namespace gapfarm
