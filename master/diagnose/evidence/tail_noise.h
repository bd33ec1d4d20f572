// Noise as predictions need it: with the tails that drives and readings have.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "master/diagnose/evidence/residuals.h"

namespace gapfarm {

struct DiagnosisSubject;  // master/diagnose/subject.h

// The noise of a log's trials with its log-likelihood.
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

}  // namespace gapfarm
