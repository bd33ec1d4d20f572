#include "common/score/scale_mixture.h"

#include <Eigen/Dense>
#include <array>
#include <cassert>
#include <cmath>

#include "common/math/algebra.h"
#include "common/math/laws.h"
#include "common/score/density.h"

namespace gapfarm {
namespace {

constexpr std::size_t kScales = 9;
// How far from its mode the scale's density is followed, in nats, below and above, and the greatest
// scale: an s.d. 32 times the core's.  What lies beyond is the outliers' affair.
constexpr double kNatsBelow = 4;
constexpr double kNatsAbove = 7;
constexpr double kMostScale = 1000;

// Nats that the density of log a has lost at `log_a`; its mode is 0.
double lost(double freedom, double log_a) { return freedom / 2 * (std::exp(-log_a) + log_a - 1); }

// Where that many nats are lost on one side of the mode, by bisection.
double where_lost(double freedom, double nats, double sign) {
  double near = 0, far = 1;
  while (lost(freedom, sign * far) < nats) far *= 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = (near + far) / 2;
    (lost(freedom, sign * middle) < nats ? near : far) = middle;
  }
  return sign * near;
}

}  // namespace

std::vector<TailScale> tail_scales(double tail) {
  assert(tail >= 0 && tail <= 1);
  if (tail == 0) return {{1, 1}};
  const double freedom = 1 / tail;
  const double first = where_lost(freedom, kNatsBelow, -1);
  const double last = std::min(where_lost(freedom, kNatsAbove, 1), std::log(kMostScale));
  std::vector<TailScale> scales;
  double sum = 0;
  for (std::size_t k = 0; k < kScales; ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(kScales - 1);
    const double log_a = first + share * (last - first);
    scales.push_back({std::exp(log_a), std::exp(-lost(freedom, log_a))});
    sum += scales.back().weight;
  }
  for (TailScale& s : scales) s.weight /= sum;
  return scales;
}

double draw_tail_scale(double tail, Stream& stream) {
  if (tail == 0) return 1;
  double left = stream.uniform();
  const std::vector<TailScale> scales = tail_scales(tail);
  for (const TailScale& s : scales) {
    left -= s.weight;
    if (left < 0) return s.scale;
  }
  return scales.back().scale;
}

TailedDensity::TailedDensity(const NoiseTails& tails) : tails_(tails) {
  const std::vector<TailScale> readings = tail_scales(tails.reading);
  for (const TailScale& a : tail_scales(tails.drive)) {
    for (const TailScale& b : readings) {
      scales_.push_back({a.scale, b.scale, std::log(a.weight * b.weight)});
    }
  }
}

namespace {

template <int N>
struct SmallAxes {
  Eigen::Matrix<double, N, 1> values;
  Eigen::Matrix<double, N, N> vectors;
};

// Eigen has a solver of its own for three; the general one, made anew for a size that is seldom
// asked for, is half of what this file takes to compile.
template <int N>
SmallAxes<N> axes_of(const Eigen::Matrix<double, N, N>& matrix) {
  if constexpr (N == 3) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(matrix);
    return {axes.eigenvalues(), axes.eigenvectors()};
  } else {
    const SymmetricAxes axes = axes_of_symmetric(matrix);
    return {axes.values, axes.vectors};
  }
}

}  // namespace

template <int N>
Result<double> TailedDensity::log_density_of(const Eigen::Matrix<double, N, 1>& residual,
                                             const Eigen::Matrix<double, N, N>& covariance,
                                             const Eigen::Matrix<double, N, N>& reading,
                                             double outlier_share) const {
  using Matrix = Eigen::Matrix<double, N, N>;
  using Array = Eigen::Array<double, N, 1>;
  ASSIGN_OR_RETURN(const auto whole, FactorisedCovariance<N>::factorise(covariance));
  if (tails_.gaussian()) return log_predictive_density(residual, whole, outlier_share);
  const auto readings = FactorisedCovariance<N>::factorise(reading);
  if (!readings) return Error{"of the readings: " + readings.error().message};
  // In axes in which the readings' covariance is 1 and the drive's diagonal, every pair of scales
  // is.
  const auto lower = readings->lower().template triangularView<Eigen::Lower>();
  const Matrix half = lower.solve(Matrix(covariance - reading));
  const Matrix drive = lower.solve(Matrix(half.transpose()));
  const SmallAxes<N> axes = axes_of<N>(drive);
  const Array spread = axes.values.array().max(0.0);
  const Array squares = (axes.vectors.transpose() * lower.solve(residual)).array().square();
  std::array<double, kScales * kScales> logs;
  std::size_t count = 0;
  for (const ScalePair& pair : scales_) {
    const Array variances = pair.drive * spread + pair.reading;
    logs[count++] =
        pair.log_weight - 0.5 * (std::log(variances.prod()) + (squares / variances).sum());
  }
  const double mixture = log_sum_exp(std::span(logs.data(), count)) -
                         0.5 * (N * kLogTwoPi + readings->log_determinant());
  if (outlier_share == 0) return mixture;
  const std::array<double, 2> both = {std::log1p(-outlier_share) + mixture,
                                      std::log(outlier_share) + log_tail_density(residual, whole)};
  return log_sum_exp(both);
}

Result<double> TailedDensity::log_density(const Eigen::Vector3d& residual,
                                          const Eigen::Matrix3d& covariance,
                                          const Eigen::Matrix3d& reading,
                                          double outlier_share) const {
  return log_density_of<3>(residual, covariance, reading, outlier_share);
}

Result<double> TailedDensity::log_position_density(const Eigen::Vector3d& residual,
                                                   const Eigen::Matrix3d& covariance,
                                                   const Eigen::Matrix3d& reading,
                                                   double outlier_share) const {
  return log_density_of<2>(residual.head<2>(), covariance.topLeftCorner<2, 2>(),
                           reading.topLeftCorner<2, 2>(), outlier_share);
}

Result<double> TailedDensity::log_heading_density(const Eigen::Vector3d& residual,
                                                  const Eigen::Matrix3d& covariance,
                                                  const Eigen::Matrix3d& reading,
                                                  double outlier_share) const {
  return log_density_of<1>(residual.tail<1>(), covariance.bottomRightCorner<1, 1>(),
                           reading.bottomRightCorner<1, 1>(), outlier_share);
}

Result<double> expected_log_density(const TailedDensity& density, const NoiseTails& tails,
                                    const Eigen::Matrix3d& covariance,
                                    const Eigen::Matrix3d& reading, double outlier_share,
                                    unsigned draws, Stream& stream) {
  const Eigen::Matrix3d drive = covariance - reading;
  double sum = 0;
  for (unsigned i = 0; i < draws; ++i) {
    const double a = draw_tail_scale(tails.drive, stream);
    const double b = draw_tail_scale(tails.reading, stream);
    const Eigen::Matrix3d drawn = a * drive + b * reading;
    ASSIGN_OR_RETURN(const auto factor, Covariance3::factorise(drawn));
    Eigen::Vector3d z;
    for (double& value : z) value = stream.normal();
    ASSIGN_OR_RETURN(const auto score,
                     density.log_density(factor.lower() * z, covariance, reading, outlier_share));
    sum += score;
  }
  return sum / draws;
}

}  // namespace gapfarm
