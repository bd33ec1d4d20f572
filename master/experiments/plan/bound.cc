// How much better a plan could be at most.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "common/math/algebra.h"
#include "master/experiments/plan/visibility.h"

namespace gapfarm::plan {
namespace {

constexpr int kSteps = 200;            // of Frank and Wolfe; each brings the bound nearer
constexpr double kCloseEnough = 1e-3;  // nats an unknown

// Of all unknowns' information M, what is left of the first ones' once the others are allowed for
// (Schur's complement), and the map whose congruence takes any other information to at least that.
struct Allowed {
  Eigen::MatrixXd S, L;
};

Allowed allowed_for(const Eigen::MatrixXd& M, Eigen::Index nuisances) {
  const Eigen::Index s = M.rows() - nuisances;
  Allowed a;
  a.L = Eigen::MatrixXd::Zero(s, M.rows());
  a.L.leftCols(s).setIdentity();
  if (nuisances > 0) {
    a.L.rightCols(nuisances) = -M.bottomRightCorner(nuisances, nuisances)
                                    .llt()
                                    .solve(M.bottomLeftCorner(nuisances, s))
                                    .transpose();
  }
  a.S = a.L * M * a.L.transpose();
  return a;
}

// Of the information M: its value, and the slope that bounds those of others.
struct Criterion {
  double value = 0;
  Eigen::MatrixXd slope;
};

double log_det(const Eigen::MatrixXd& S) {
  return 2 * S.llt().matrixLLT().diagonal().array().log().sum();
}

// Frank and Wolfe's steps: `criterion` of information M is a concave sum of `size` logarithms, and
// that of any other M* is at most its value and size log(|M*^1/2 slope|^2 / size).  That is linear
// in M*, so no M* of `times` experiments has more than `times` the best of them.
double best_over(const std::vector<Rows>& candidates, double times, double size,
                 const std::function<Criterion(const Eigen::MatrixXd&)>& criterion,
                 Eigen::MatrixXd M, double planned) {
  const Eigen::MatrixXd prior = Eigen::MatrixXd::Identity(M.rows(), M.cols());
  double bound = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kSteps; ++k) {
    const Criterion at = criterion(M);
    std::size_t best = 0;
    double most = -1;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const double gain = (candidates[c] * at.slope).squaredNorm();
      if (gain <= most) continue;
      most = gain;
      best = c;
    }
    const double ahead = at.value - planned;
    const double share = (at.slope.squaredNorm() + times * most) / size;
    bound = std::min(bound, ahead + size * std::log(share));
    if (bound - ahead < kCloseEnough * size) break;
    const double step = 2.0 / (k + 3);
    const Eigen::MatrixXd there = prior + times * candidates[best].transpose() * candidates[best];
    M = (1 - step) * M + step * there;
  }
  return std::exp(std::min(0.0, -bound / (2 * size)));
}

}  // namespace

// Schur's complement of any M* is at most L M* L' for the L of any M, so that its log det is at
// most that of M's plus s log(tr(S^-1 L M* L') / s): determinants of a trace are greatest where all
// directions are alike.  At the best M it is equality (Kiefer and Wolfowitz 1960).
double best_over_plan(const std::vector<Rows>& candidates, Eigen::Index nuisances,
                      const std::vector<std::size_t>& chosen) {
  if (chosen.empty()) return 1;
  const Eigen::Index unknowns = candidates.front().cols();
  Eigen::MatrixXd M = Eigen::MatrixXd::Identity(unknowns, unknowns);
  for (const std::size_t c : chosen) M += candidates[c].transpose() * candidates[c];
  const auto criterion = [&](const Eigen::MatrixXd& at) {
    const Allowed a = allowed_for(at, nuisances);
    const Eigen::MatrixXd slope = a.S.llt().matrixL().solve(a.L).transpose();
    return Criterion{log_det(a.S), slope};
  };
  return best_over(candidates, static_cast<double>(chosen.size()),
                   static_cast<double>(unknowns - nuisances), criterion, M, criterion(M).value);
}

// 1 / (M^-1)_ii is the least of u' M u over all u whose i-th is 1, so that of M* is at most u' M* u
// for the u of any M; and the mean of logarithms is at most the logarithm of the mean.
double best_over_drive(const std::vector<Rows>& rates, double seconds,
                       const std::vector<std::ptrdiff_t>& wanted,
                       const Eigen::VectorXd& variances) {
  if (rates.empty() || wanted.empty() || seconds <= 0) return 1;
  const Eigen::Index unknowns = variances.size();
  double planned = 0;
  for (const auto i : wanted) planned -= std::log(variances[i]);
  const auto criterion = [&](const Eigen::MatrixXd& M) {
    const Eigen::MatrixXd inverse = inverse_of_symmetric(M);
    Criterion at{0, Eigen::MatrixXd(unknowns, static_cast<Eigen::Index>(wanted.size()))};
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      const double variance = inverse(wanted[k], wanted[k]);
      at.value -= std::log(variance);
      at.slope.col(static_cast<Eigen::Index>(k)) = inverse.col(wanted[k]) / std::sqrt(variance);
    }
    return at;
  };
  const Eigen::MatrixXd start = variances.cwiseInverse().asDiagonal();
  return best_over(rates, seconds, static_cast<double>(wanted.size()), criterion, start, planned);
}

}  // namespace gapfarm::plan
