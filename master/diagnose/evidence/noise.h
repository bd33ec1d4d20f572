// How much the drive varies, from what no smooth function of the covariates explains.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "master/diagnose/evidence/covariates.h"
#include "master/diagnose/evidence/residuals.h"
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

struct DiagnosisSubject;  // master/diagnose/subject.h

struct NoiseFit {
  NoiseEstimate noise;
  double nats = 0;  // over all trials
};

// Maximum likelihood of the density that predictions have (TailedDensity) over the drive's and the
// readings' noise, and with `tails` over the two tail weights.  Not robust: what misses a model is
// a part of what its predictions vary by.  `residuals`: one a trial, m, m, rad, in the predicted
// end's axes.  REQUIRES: a subject with tails.
NoiseFit fit_predictive_noise(std::span<const ResidualTrial> trials,
                              std::span<const Eigen::Vector3d> residuals,
                              const NoiseEstimate& start, const DiagnosisSubject& subject,
                              double outlier_share, bool tails);

// Log scores (nats) of residuals under a noise; -1000 where there is no density.
std::vector<double> predictive_scores(std::span<const ResidualTrial> trials,
                                      std::span<const Eigen::Vector3d> residuals,
                                      const NoiseEstimate& noise, const DiagnosisSubject& subject,
                                      double outlier_share);

// What perfect predictions score on average when the noise is that.
double perfect_score(std::span<const ResidualTrial> trials, const NoiseEstimate& noise,
                     const DiagnosisSubject& subject, double outlier_share);

// Of any noise that is fitted: keeps logarithms and covariances finite.
inline constexpr double kLeastDeviation = 1e-4;

// Robust maximum likelihood over the drive's two standard deviations (and the readings' two, with
// `fit_pose`): squared distances beyond 14 count by their logarithm, so that rare events do not
// pass for noise (a Gaussian has one trial in 340 beyond, which narrows the result by 1 %).  Values
// of `start` that are 0 are unknown; all are kept within [1e-4, 0.5].  REQUIRES: without
// `fit_pose`, a positive `start.pose`.  `residuals`: one a trial, m, m, rad.  The logarithm counts
// more than 3 times (kNoiseTail), a trial's dimensions: no share of such events makes the noise
// vanish.
NoiseEstimate refit_drive_noise(std::span<const ResidualTrial> trials,
                                std::span<const Eigen::Vector3d> residuals,
                                const NoiseEstimate& start, bool fit_pose,
                                CovarianceOf covariance = trial_covariance);

}  // namespace gapfarm
