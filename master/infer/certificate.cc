#include "master/infer/certificate.h"

#include <Eigen/Dense>
#include <cmath>

#include "common/math/algebra.h"
#include "common/math/laws.h"
#include "master/infer/settings.h"

namespace gapfarm::infer {
namespace {

// Of Student's log density (kStudentTail) at its best scale, over Gaussian residuals of three
// dimensions: mean curvature, and variance of a slope, in those of the Gaussian's own.  By
// simulation of 200,000 of them.
constexpr double kCurvature = 0.998, kSlopeVariance = 1.175;
constexpr double kNothing = 1e-9;  // of the greatest information: none

}  // namespace

Eigen::MatrixXd beyond(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& nuisances) {
  if (nuisances.cols() == 0) return rows;
  const Eigen::MatrixXd inner = Eigen::MatrixXd::Identity(nuisances.cols(), nuisances.cols()) +
                                nuisances.transpose() * nuisances;
  return rows - nuisances * inner.llt().solve(nuisances.transpose() * rows);
}

Eigen::MatrixXd information(const Eigen::MatrixXd& slopes, const Eigen::MatrixXd& nuisances) {
  return slopes.transpose() * beyond(slopes, nuisances);
}

Eigen::VectorXd least_deviations(const Eigen::MatrixXd& information) {
  Eigen::VectorXd sizes = information.diagonal().cwiseMax(0).cwiseSqrt();
  for (double& size : sizes) size = size > 0 ? size : 1;
  const Eigen::MatrixXd unit =
      sizes.cwiseInverse().asDiagonal() * information * sizes.cwiseInverse().asDiagonal();
  const SymmetricAxes axes = axes_of_symmetric(unit);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(sizes.size());
  for (Eigen::Index k = 0; k < sizes.size(); ++k) {
    const Eigen::VectorXd parts = axes.vectors.col(k).cwiseAbs2();
    if (axes.values[k] > kNothing) {
      squares += parts / axes.values[k];
    } else {
      squares = (parts.array() > kNothing).select(INFINITY, squares);
    }
  }
  return squares.cwiseSqrt().cwiseQuotient(sizes);
}

double chance_of_exceeding(double threshold, double freedom, double noncentrality) {
  return noncentrality <= 0 ? chi_squared_above(freedom, threshold)
                            : noncentral_chi_squared_above(freedom, noncentrality, threshold);
}

double noncentrality_for(double power, double threshold, double freedom) {
  if (chance_of_exceeding(threshold, freedom, 0) >= power) return 0;
  return noncentrality_of(freedom, threshold, power);
}

double detectable_squares(double least_gain, Eigen::Index parameters) {
  const auto freedom = static_cast<double>(parameters);
  const double shrinks = kCurvature / kSlopeVariance;
  return noncentrality_for(kDetectablePower, 2 * (least_gain + freedom) * shrinks, freedom) /
         (kCurvature * shrinks);
}

}  // namespace gapfarm::infer
