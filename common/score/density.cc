#include "common/score/density.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <sstream>

#include "common/math/algebra.h"
#include "common/math/laws.h"

namespace gapfarm {
namespace {

Eigen::Vector3d in_metres(const Eigen::Vector3d& residual) {
  return {residual[0], residual[1], kHeadingLength_m * residual[2]};
}

}  // namespace

template <int N>
Result<FactorisedCovariance<N>> FactorisedCovariance<N>::factorise(const Matrix& covariance) {
  const Eigen::LLT<Matrix> factor(covariance);
  FactorisedCovariance result;
  result.lower_ = factor.matrixL();
  if (factor.info() != Eigen::Success || !result.lower_.allFinite() ||
      result.lower_.diagonal().minCoeff() <= 0) {
    std::ostringstream text;
    text << "covariance [" << covariance.format(Eigen::IOFormat(6, Eigen::DontAlignCols, " ", "; "))
         << "] is not positive definite; add pose noise or a measurement resolution to it";
    return Error{text.str()};
  }
  result.log_determinant_ = 2 * result.lower_.diagonal().array().log().sum();
  return result;
}

template <int N>
double FactorisedCovariance<N>::squared_distance(const Vector& residual) const {
  return lower_.template triangularView<Eigen::Lower>().solve(residual).squaredNorm();
}

template <int N>
double log_normal_density(const ResidualOf<N>& residual,
                          const FactorisedCovariance<N>& covariance) {
  return -0.5 *
         (N * kLogTwoPi + covariance.log_determinant() + covariance.squared_distance(residual));
}

template <int N>
double log_tail_density(const ResidualOf<N>& residual, const FactorisedCovariance<N>& covariance) {
  // Gamma((nu + N) / 2) / Gamma(nu / 2) for nu = 3: Gamma(3/2) = sqrt(pi) / 2, Gamma(2) = 1,
  // Gamma(5/2) = 3/2 Gamma(3/2), Gamma(3) = 2.
  static_assert(kTailFreedom == 3 && N >= 1 && N <= 3);
  const double gammas = N == 2 ? 1.5 : (N == 1 ? 2 : 4) / std::sqrt(std::numbers::pi);
  const double log_gammas = std::log(gammas);
  const double q = covariance.squared_distance(residual) / (kTailScale * kTailFreedom);
  return log_gammas - 0.5 * N * std::log(kTailFreedom * std::numbers::pi) -
         0.5 * (covariance.log_determinant() + N * std::log(kTailScale)) -
         0.5 * (kTailFreedom + N) * std::log1p(q);
}

double log_sum_exp(std::span<const double> logarithms) {
  double greatest = -INFINITY;
  for (double l : logarithms) greatest = std::max(greatest, l);
  if (greatest == -INFINITY) return greatest;
  double sum = 0;
  for (double l : logarithms) sum += std::exp(l - greatest);
  return greatest + std::log(sum);
}

template <int N>
double log_predictive_density(const ResidualOf<N>& residual,
                              const FactorisedCovariance<N>& covariance, double outlier_share) {
  assert(outlier_share >= 0 && outlier_share < 1);
  const double normal = std::log1p(-outlier_share) + log_normal_density(residual, covariance);
  if (outlier_share == 0) return normal;
  const double tail = std::log(outlier_share) + log_tail_density(residual, covariance);
  const double greater = std::max(normal, tail);
  return greater + std::log1p(std::exp(std::min(normal, tail) - greater));
}

#define OF_SIZE(N)                                                                                \
  template class FactorisedCovariance<N>;                                                         \
  template double log_normal_density<N>(const ResidualOf<N>&, const FactorisedCovariance<N>&);    \
  template double log_tail_density<N>(const ResidualOf<N>&, const FactorisedCovariance<N>&);      \
  template double log_predictive_density<N>(const ResidualOf<N>&, const FactorisedCovariance<N>&, \
                                            double);
OF_SIZE(1)
OF_SIZE(2)
OF_SIZE(3)
#undef OF_SIZE

double expected_norm(const Eigen::Ref<const Eigen::VectorXd>& mean,
                     const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  const double mean_square = mean.squaredNorm() + covariance.trace();
  if (!(mean_square > 0)) return 0;
  const SymmetricAxes axes = axes_of_symmetric(covariance);
  const Eigen::ArrayXd variances = axes.values.cwiseMax(0).array() / mean_square;
  const Eigen::ArrayXd squares = (axes.vectors.transpose() * mean).array().square() / mean_square;

  // With Q of mean 1 and t = e^u the integrand (1 - E exp(-t Q)) e^(-u/2) falls like e^(-|u|/2) on
  // both sides and is analytic in a strip, so the trapezoid rule converges exponentially; its tails
  // beyond +-kEnd are geometric sums.
  constexpr double kStep = 0.5;
  constexpr double kEnd = 18;
  const auto integrand = [&](double u) {
    const double t = std::exp(u);
    double exponent = 0;
    for (Eigen::Index i = 0; i < variances.size(); ++i) {
      const double spread = 1 + 2 * t * variances[i];
      exponent -= 0.5 * std::log(spread) + t * squares[i] / spread;
    }
    return -std::expm1(exponent) * std::exp(-0.5 * u);
  };
  const int nodes = static_cast<int>(2 * kEnd / kStep);
  double sum = 0;
  for (int i = 0; i <= nodes; ++i) sum += integrand(-kEnd + i * kStep);
  const double tail = 1 / std::expm1(0.5 * kStep);
  sum += tail * (integrand(-kEnd) + integrand(kEnd));
  return std::sqrt(mean_square) * kStep * sum / (2 * std::sqrt(std::numbers::pi));
}

double energy_score_of(const Eigen::Ref<const Eigen::VectorXd>& residual,
                       const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  // X - X' ~ N(0, 2 S), and E||X - X'|| / 2 = E||X|| / sqrt(2).
  return expected_norm(residual, covariance) -
         expected_norm(Eigen::VectorXd::Zero(residual.size()), covariance) * std::numbers::sqrt2 /
             2;
}

double gaussian_energy_score(const Eigen::Vector3d& residual, const Eigen::Matrix3d& covariance) {
  const Eigen::Vector3d units(1, 1, kHeadingLength_m);
  const Eigen::Matrix3d scaled = units.asDiagonal() * covariance * units.asDiagonal();
  return energy_score_of(in_metres(residual), scaled);
}

}  // namespace gapfarm
