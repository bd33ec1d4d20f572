// Predictive densities and proper scores of a residual (x, y, theta) in (m, m, rad).
#pragma once

#include <Eigen/Core>
#include <span>
#include <type_traits>

#include "common/base/result.h"

namespace gapfarm {

// A symmetric positive definite matrix of a whole residual (3), its position (2) or its heading
// (1), factorised.
template <int N>
class FactorisedCovariance {
 public:
  using Matrix = Eigen::Matrix<double, N, N>;
  using Vector = Eigen::Matrix<double, N, 1>;

  // Uses the lower triangle.  Error: not finite or not positive definite; the message shows the
  // matrix and says so.
  static Result<FactorisedCovariance> factorise(const Matrix& covariance);

  double log_determinant() const { return log_determinant_; }
  // r^T S^-1 r.
  double squared_distance(const Vector& residual) const;
  const Matrix& lower() const { return lower_; }  // S = L L^T

 private:
  Matrix lower_;
  double log_determinant_ = 0;
};
using Covariance3 = FactorisedCovariance<3>;
template <int N>
using ResidualOf = std::type_identity_t<Eigen::Matrix<double, N, 1>>;

// The heavy tail of the predictive density: multivariate t.
constexpr double kTailFreedom = 3;
constexpr double kTailScale = 9;  // scale matrix over the Gaussian's covariance

// Log density in nats; the units of the density are 1 / (m^2 rad), of its marginals 1 / m^2 and
// 1 / rad.
template <int N>
double log_normal_density(const ResidualOf<N>& residual, const FactorisedCovariance<N>& covariance);
// Multivariate t with kTailFreedom degrees of freedom and scale matrix kTailScale * S.
template <int N>
double log_tail_density(const ResidualOf<N>& residual, const FactorisedCovariance<N>& covariance);
// (1 - share) N(0, S) + share t, by log-sum-exp: finite for every finite residual when share > 0.
// `outlier_share` in [0, 1).
template <int N>
double log_predictive_density(const ResidualOf<N>& residual,
                              const FactorisedCovariance<N>& covariance, double outlier_share);

// log sum exp of the logarithms, without overflow; -infinity of none.
double log_sum_exp(std::span<const double> logarithms);

// The energy score needs one norm for positions and headings: a heading of 1 rad counts as this
// many metres, about the distance from the turning centre to a corner of the robot.
constexpr double kHeadingLength_m = 0.1;

// E||X|| of X ~ N(mean, covariance), any dimension, covariance positive semidefinite; to about
// 1e-7 of itself.  By E sqrt(Q) = 1 / (2 sqrt(pi)) Int_0^inf (1 - E exp(-t Q)) t^(-3/2) dt with the
// Laplace transform of a Gaussian quadratic form, so it is deterministic.
double expected_norm(const Eigen::Ref<const Eigen::VectorXd>& mean,
                     const Eigen::Ref<const Eigen::MatrixXd>& covariance);

// Energy score E||X - r|| - E||X - X'|| / 2, lower is better (Gneiting and Raftery 2007), of a
// prediction X ~ N(0, S) for the residual r, in r's unit.
double energy_score_of(const Eigen::Ref<const Eigen::VectorXd>& residual,
                       const Eigen::Ref<const Eigen::MatrixXd>& covariance);
// The same in m, headings scaled by kHeadingLength_m.
double gaussian_energy_score(const Eigen::Vector3d& residual, const Eigen::Matrix3d& covariance);

}  // namespace gapfarm
