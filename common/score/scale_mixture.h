// Heavy-tailed predictive densities: two sources of spread, each of Student's t by a tail weight of
// its own.
//
// Student's t with n degrees of freedom is a Gaussian whose covariance is multiplied by a random
// scale a, n / a being chi-square with n.  A residual is the sum of what the drive does and of what
// the readings do, each with a scale of its own: sum_jk w_j w_k N(0, a_j D + b_k R).  An
// outlier drive and a reading that is off then leave different marks, and a far residual is judged
// by the source that can have made it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/base/result.h"
#include "common/random/stream.h"

namespace gapfarm {

// 1 / degrees of freedom of each source's noise, in [0, 1]; 0: Gaussian.
struct NoiseTails {
  double drive = 0;
  double reading = 0;

  bool gaussian() const { return drive == 0 && reading == 0; }
  bool operator==(const NoiseTails&) const = default;
};

// A scale of the covariance and its weight.
struct TailScale {
  double scale = 1;
  double weight = 1;
};
// Nine scales, even in their logarithm, whose mixture of Gaussians is Student's t to 3 % of the
// density out to 20 standard deviations (with many degrees of freedom, to where its density is a
// thousandth of a millionth); the weights sum to 1.  {{1, 1}} of 0.  REQUIRES: tail in [0, 1].
std::vector<TailScale> tail_scales(double tail);

// One of those, drawn by its weight; of a Gaussian nothing is drawn.
double draw_tail_scale(double tail, Stream& stream);

class TailedDensity {
 public:
  explicit TailedDensity(const NoiseTails& tails);

  // Log density (nats) of a residual whose spread is `covariance`, `reading` of it the readings':
  // with the share of outliers of log_predictive_density(), which it is, to the bit, without tails.
  // `outlier_share` in [0, 1).  Errors: a covariance, or with tails that of the readings, that is
  // not positive definite.
  Result<double> log_density(const Eigen::Vector3d& residual, const Eigen::Matrix3d& covariance,
                             const Eigen::Matrix3d& reading, double outlier_share) const;
  // The same of the marginals of position and of heading.
  Result<double> log_position_density(const Eigen::Vector3d& residual,
                                      const Eigen::Matrix3d& covariance,
                                      const Eigen::Matrix3d& reading, double outlier_share) const;
  Result<double> log_heading_density(const Eigen::Vector3d& residual,
                                     const Eigen::Matrix3d& covariance,
                                     const Eigen::Matrix3d& reading, double outlier_share) const;

 private:
  template <int N>
  Result<double> log_density_of(const Eigen::Matrix<double, N, 1>& residual,
                                const Eigen::Matrix<double, N, N>& covariance,
                                const Eigen::Matrix<double, N, N>& reading,
                                double outlier_share) const;

  struct ScalePair {
    double drive = 1, reading = 1;
    double log_weight = 0;
  };

  NoiseTails tails_;
  std::vector<ScalePair> scales_;
};

// Mean log density of `draws` residuals that are spread with `tails`; where these are the density's
// own, what a perfect prediction scores.  Errors: as log_density().
Result<double> expected_log_density(const TailedDensity& density, const NoiseTails& tails,
                                    const Eigen::Matrix3d& covariance,
                                    const Eigen::Matrix3d& reading, double outlier_share,
                                    unsigned draws, Stream& stream);

}  // namespace gapfarm
