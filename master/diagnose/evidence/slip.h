// Now and then a side loses some of its speed for a trial: a mixture against one Gaussian.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "master/diagnose/evidence/residuals.h"
#include "master/diagnose/study.h"

namespace gapfarm {

struct SlipFit {
  double gain = 0;  // nats over all trials
  double probability = 0;
  double loss = 0;
  NoiseEstimate noise;  // with the events taken out
};

// In each trial each side loses, with the probability, a share of its speed uniform in (0, loss).
// Gaussian residuals stay below a gain of 8.
// Both hypotheses with the drive's noise refitted.  Trials with a false `mask` do not count.
SlipFit fit_slip(std::span<const ResidualTrial> trials, std::span<const Eigen::Vector3d> residuals,
                 const std::vector<bool>& mask, const NoiseEstimate& start);

struct SlipTrial {
  double score = 0;    // log predictive density, nats
  double squared = 0;  // squared distance from where it would end without, and
  double nearest = 0;  // from the nearest place where it ends if one side slips
};
// `mean_loss`: share of the sides' speed that the predictions of `residuals` lost to slips already.
// As a worker scores a prediction with slips: every event of the mixture has the outliers' tail.
std::vector<SlipTrial> trials_with_slips(std::span<const ResidualTrial> trials,
                                         std::span<const Eigen::Vector3d> residuals,
                                         const SlipFit& fit, double mean_loss,
                                         double outlier_share);

// Mean fourth power over squared mean square: 3 for a Gaussian, and where there is nothing.
double residual_kurtosis(const Eigen::VectorXd& whitened);

}  // namespace gapfarm
