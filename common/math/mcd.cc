#include "common/math/mcd.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/base/ranges.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"

namespace gapfarm {
namespace {

using Index = Eigen::Index;

// A pivot below this share of the greatest variance is rounding error.
constexpr double kSingularShare = 1e-14;
// A dimension's spread is judged against at least this share of its magnitude.
constexpr double kConstantShare = 1e-8;
constexpr std::size_t kFinalists = 10;  // of the starts, run to convergence
constexpr double kKept = 0.975;         // of chi-square, in the reweighted estimate

struct Fit {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;  // divided by the count, ridge included
  double log_determinant = -std::numeric_limits<double>::infinity();
  std::vector<std::size_t> subset;
  bool singular() const { return std::isinf(log_determinant); }
};

class Concentration {
 public:
  Concentration(const Eigen::MatrixXd& points, std::size_t support, Eigen::VectorXd ridge)
      : points_(points), support_(support), ridge_(std::move(ridge)) {
    const Eigen::VectorXd centre = points.rowwise().mean();
    const Eigen::ArrayXd variance = (points.colwise() - centre).rowwise().squaredNorm().array() /
                                    static_cast<double>(points.cols());
    // A constant column keeps the rounding error of its mean; it must not count as spread.
    const Eigen::ArrayXd magnitude = points.rowwise().lpNorm<Eigen::Infinity>();
    scale_ =
        variance.max((kConstantShare * magnitude).square()).max(std::numeric_limits<double>::min());
  }

  Fit fit(std::vector<std::size_t> subset) const {
    Fit result;
    const auto count = static_cast<double>(subset.size());
    result.mean = Eigen::VectorXd::Zero(points_.rows());
    for (std::size_t i : subset) result.mean += points_.col(static_cast<Index>(i));
    result.mean /= count;
    result.covariance = Eigen::MatrixXd::Zero(points_.rows(), points_.rows());
    Eigen::VectorXd difference(points_.rows());
    for (std::size_t i : subset) {
      difference = points_.col(static_cast<Index>(i)) - result.mean;
      result.covariance.noalias() += difference * difference.transpose();
    }
    result.covariance /= count;
    result.covariance.diagonal() += ridge_;
    result.subset = std::move(subset);
    // Judged in units of each dimension's own spread, so that units do not matter.
    const Eigen::VectorXd unit = scale_.cwiseSqrt().cwiseInverse();
    const Eigen::LDLT<Eigen::MatrixXd> factor(unit.asDiagonal() * result.covariance *
                                              unit.asDiagonal());
    const Eigen::VectorXd pivots = factor.vectorD();
    if (factor.info() == Eigen::Success && pivots.minCoeff() > kSingularShare) {
      result.log_determinant = pivots.array().log().sum() + scale_.array().log().sum();
    }
    return result;
  }

  // Squared Mahalanobis distances of all points.  REQUIRES: !fit.singular().
  Eigen::VectorXd distances(const Fit& fit) const {
    const Eigen::LLT<Eigen::MatrixXd> factor(fit.covariance);
    Eigen::MatrixXd whitened = points_.colwise() - fit.mean;
    factor.matrixL().solveInPlace(whitened);
    return whitened.colwise().squaredNorm().transpose();
  }

  // C-step: the `support` points nearest to the fit.  Never increases the determinant.
  Fit step(const Fit& from) const {
    const Eigen::VectorXd d = distances(from);
    std::vector<std::size_t> order = indices(static_cast<std::size_t>(points_.cols()));
    const auto closer = [&d](std::size_t a, std::size_t b) {
      const double da = d[static_cast<Index>(a)], db = d[static_cast<Index>(b)];
      return da != db ? da < db : a < b;
    };
    const auto end = order.begin() + static_cast<std::ptrdiff_t>(support_);
    std::nth_element(order.begin(), end - 1, order.end(), closer);
    order.erase(end, order.end());
    std::sort(order.begin(), order.end());
    return fit(std::move(order));
  }

  // A random subset of 4, enlarged point by point while its covariance is singular.
  Fit random_start(Stream& stream) const {
    const auto n = static_cast<std::size_t>(points_.cols());
    std::vector<std::size_t> pool = indices(n);
    const auto draw = [&](std::size_t k) { std::swap(pool[k], pool[k + stream.below(n - k)]); };
    auto size = std::size_t{4};
    for (std::size_t k = 0; k < size; ++k) draw(k);
    for (;; ++size) {
      Fit start = fit({pool.begin(), pool.begin() + static_cast<std::ptrdiff_t>(size)});
      if (!start.singular() || size == n) return start;
      draw(size);
    }
  }

  // The best fit found; singular() when a singular half was met.
  Fit search(const McdSettings& settings, Stream& stream) const {
    std::vector<Fit> best;
    const auto better = [](const Fit& a, const Fit& b) {
      return a.log_determinant < b.log_determinant;
    };
    for (unsigned i = 0; i < std::max(1U, settings.starts); ++i) {
      Fit fit = random_start(stream);
      for (int k = 0; k < 2 && !fit.singular(); ++k) fit = step(fit);
      if (fit.singular()) return fit;
      const bool known = contains(best, fit.subset, &Fit::subset);
      if (known) continue;
      best.insert(std::upper_bound(best.begin(), best.end(), fit, better), fit);
      if (best.size() > kFinalists) best.pop_back();
    }
    for (Fit& fit : best) {
      for (int k = 0; k < 100; ++k) {
        Fit next = step(fit);
        if (next.singular()) return next;
        if (next.subset == fit.subset) break;
        fit = std::move(next);
      }
    }
    return *std::min_element(best.begin(), best.end(), better);
  }

 private:
  const Eigen::MatrixXd& points_;
  std::size_t support_;
  Eigen::VectorXd ridge_;  // variances
  Eigen::VectorXd scale_;  // variance of each dimension
};

Eigen::VectorXd ridge_variances(const Eigen::MatrixXd& points) {
  Eigen::VectorXd ridge(points.rows());
  for (Index row = 0; row < points.rows(); ++row) {
    std::vector<double> sorted(static_cast<std::size_t>(points.cols()));
    Eigen::VectorXd::Map(sorted.data(), points.cols()) = points.row(row).transpose();
    std::sort(sorted.begin(), sorted.end());
    const double range = sorted.back() - sorted.front();
    double gap = range;
    for (std::size_t i = 1; i < sorted.size(); ++i) {
      const double step = sorted[i] - sorted[i - 1];
      if (step > 1e-9 * range) gap = std::min(gap, step);
    }
    const double resolution = gap / std::sqrt(12.0);
    const double magnitude = std::max(std::abs(sorted.front()), std::abs(sorted.back()));
    const double sd = std::max({resolution, 1e-6 * range, 1e-9, kConstantShare * magnitude});
    ridge[row] = sd * sd;
  }
  return ridge;
}

RobustEstimate plain_estimate(const Eigen::MatrixXd& points) {
  const auto n = static_cast<std::size_t>(points.cols());
  Fit fit = Concentration(points, n, Eigen::VectorXd::Zero(points.rows())).fit(indices(n));
  const double unbias = n > 1 ? static_cast<double>(n) / static_cast<double>(n - 1) : 1;
  RobustEstimate result;
  result.outcome = McdOutcome::kTooFew;
  result.covariance = fit.covariance * unbias;
  if (fit.singular()) result.covariance.diagonal() += ridge_variances(points);
  result.mean = fit.mean;
  result.raw_covariance = result.covariance;
  result.raw_log_determinant = std::log(result.covariance.determinant());
  result.support = indices(n);
  result.weights.assign(n, 1.0);
  return result;
}

// The factor that makes the covariance of the share of points nearest to the mean that of all.
double consistency(double share) {
  const double q = chi_squared_quantile(3, share);
  return share / chi_squared_below(5, q);
}

// The cube root of the determinant of the uncorrected estimate at the normal averages about
// 1 - e^log / n^power (the form of Pison et al. 2002).
struct Deficit {
  double log;
  double power;
  double share(double n) const { return 1 - std::exp(log) / std::pow(n, power); }
};
struct Deficits {
  Deficit half, most;  // of a share of 0.5 and 0.875 in the half
};

// Pison et al.'s in three dimensions.
constexpr Deficits kRaw{{1.2890911601609358, 0.80273720974806839},
                        {0.98062657691294097, 1.0342147173926575}};
// Fitted to our own simulations (n of 16 to 160), because the published coefficients belong to a
// consistency factor of the share of points kept, which grows with the outliers trimmed; ours is
// that of the cut-off.
constexpr Deficits kReweighted{{1.558318, 0.806987}, {1.199275, 0.942506}};

// Linear in the share of the half, which is 0.75 at most, as Pison et al. do.
double small_sample(const Deficits& deficits, double n, double share) {
  const double f500 = deficits.half.share(n);
  const double f875 = deficits.most.share(n);
  const double f = f500 + (f875 - f500) / 0.375 * (share - 0.5);
  return 1 / std::max(f, 0.25);  // the fits leave their range for very few points
}

}  // namespace

RobustEstimate fast_mcd(const Eigen::MatrixXd& points, const McdSettings& settings,
                        Stream& stream) {
  assert(points.rows() == 3 && points.cols() > 0 && points.allFinite());
  const auto n = static_cast<std::size_t>(points.cols());
  if (n < 8) return plain_estimate(points);
  const std::size_t support = n / 2 + 2;  // of the greatest breakdown point
  const auto count = static_cast<double>(n);
  const double share = static_cast<double>(support) / count;

  RobustEstimate result;
  Eigen::VectorXd ridge = Eigen::VectorXd::Zero(3);
  Fit fit = Concentration(points, support, ridge).search(settings, stream);
  if (fit.singular()) {
    result.outcome = McdOutcome::kSingular;
    ridge = ridge_variances(points);
    fit = Concentration(points, support, ridge).search(settings, stream);
    assert(!fit.singular());
  }
  result.raw_log_determinant = fit.log_determinant;
  fit.covariance *= consistency(share) * small_sample(kRaw, count, share);
  result.raw_covariance = fit.covariance;

  const double cutoff = chi_squared_quantile(3, kKept);
  const Eigen::VectorXd distances = Concentration(points, support, ridge).distances(fit);
  result.weights.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    result.weights[i] = distances[static_cast<Index>(i)] <= cutoff ? 1 : 0;
  }
  MeanCovariance reweighted = weighted_mean_covariance(points, result.weights);
  result.mean = std::move(reweighted.mean);
  result.covariance =
      reweighted.covariance * consistency(kKept) * small_sample(kReweighted, count, share);
  result.covariance.diagonal() += ridge;
  result.support = std::move(fit.subset);
  return result;
}

RobustPose robust_pose(std::span<const Pose> poses, const McdSettings& settings, Stream& stream) {
  // Headings from the sample's circular centre, so that they do not wrap.
  const double centre_rad = circular_centre(mapped(poses, &Pose::theta));
  Eigen::MatrixXd vectors(3, static_cast<Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    vectors.col(static_cast<Index>(i)) << poses[i].x, poses[i].y,
        wrap_angle(poses[i].theta - centre_rad);
  }
  RobustEstimate estimate = fast_mcd(vectors, settings, stream);
  RobustPose result;
  result.outcome = estimate.outcome;
  result.mean = {estimate.mean[0], estimate.mean[1], wrap_angle(centre_rad + estimate.mean[2])};
  result.covariance = estimate.covariance;
  result.weights = std::move(estimate.weights);
  return result;
}

}  // namespace gapfarm
