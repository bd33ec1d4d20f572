// What a log can show at best: how sure an estimate may be, and from which size on what is not
// named would have been.  All by slopes at a fit.
#pragma once

#include <Eigen/Core>

namespace gapfarm::infer {

// (I + Z Z')^-1 v: whitened rows less what unit-normal nuisances take of them.  REQUIRES: as many
// rows.
Eigen::MatrixXd beyond(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& nuisances);

// Fisher information S' (I + Z Z')^-1 S of parameters whose slopes of whitened residuals are S,
// beside those nuisances.  The scale of the noise is orthogonal to all of them and costs nothing.
Eigen::MatrixXd information(const Eigen::MatrixXd& slopes, const Eigen::MatrixXd& nuisances);

// Standard deviations that no unbiased estimate beats (Cramer 1946, Rao 1945), in the parameters'
// units: of the inverse of that information.  Infinite where the slopes say nothing of one.
Eigen::VectorXd least_deviations(const Eigen::MatrixXd& information);

// Chance that a chi-squared of `freedom` degrees of freedom and this noncentrality exceeds
// `threshold`; and the noncentrality at which it does with chance `power` in (0, 1).
double chance_of_exceeding(double threshold, double freedom, double noncentrality);
double noncentrality_for(double power, double threshold, double freedom);

// Student's likeliest scale (kStudentTail) on Gaussian noise of three dimensions, in standard
// deviations.
inline constexpr double kBestScaleOfGaussian = 0.848;

// Squared size, in standard deviations, of parameters that a contest (compete()) names with the
// chance kDetectablePower where their gain is asked to be so many nats, held out: twice the gain in
// sample is a chi-squared about it, of which Student's weights leave a known share on Gaussian
// noise, and each parameter costs a nat when other observations are predicted (Stone 1977).
double detectable_squares(double least_gain, Eigen::Index parameters);

}  // namespace gapfarm::infer
