// How much better a plan could be at most.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

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

double log_det(const Eigen::MatrixXd& S) {
  return 2 * S.llt().matrixLLT().diagonal().array().log().sum();
}

}  // namespace

// Schur's complement of any M* is at most L M* L' for the L of any M, so that its log det is at
// most that of M's plus s log(tr(S^-1 L M* L') / s): determinants of a trace are greatest where all
// directions are alike.  That is linear in M*, so no M* of n experiments has more than n times the
// best of them; and at the best M it is equality (Kiefer and Wolfowitz 1960).
double best_over_plan(const std::vector<Rows>& candidates, Eigen::Index nuisances,
                      const std::vector<std::size_t>& chosen) {
  if (chosen.empty()) return 1;
  const Eigen::Index unknowns = candidates.front().cols(), s = unknowns - nuisances;
  const auto n = static_cast<double>(chosen.size());
  Eigen::MatrixXd M = Eigen::MatrixXd::Identity(unknowns, unknowns);
  for (const std::size_t c : chosen) M += candidates[c].transpose() * candidates[c];
  const double planned = log_det(allowed_for(M, nuisances).S);
  double bound = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kSteps; ++k) {
    const Allowed a = allowed_for(M, nuisances);
    const Eigen::LLT<Eigen::MatrixXd> S(a.S);
    std::size_t best = 0;
    double most = -1;
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const double gain = S.matrixL().solve(a.L * candidates[c].transpose()).squaredNorm();
      if (gain <= most) continue;
      most = gain;
      best = c;
    }
    const double prior = S.matrixL().solve(a.L).squaredNorm();
    const double at = log_det(a.S);
    const auto of = static_cast<double>(s);
    bound = std::min(bound, at - planned + of * std::log((prior + n * most) / of));
    if (bound - (at - planned) < kCloseEnough * of) break;
    const double step = 2.0 / (k + 3);
    const Eigen::MatrixXd there = Eigen::MatrixXd::Identity(unknowns, unknowns) +
                                  n * candidates[best].transpose() * candidates[best];
    M = (1 - step) * M + step * there;
  }
  return std::exp(std::min(0.0, -bound / (2 * static_cast<double>(s))));
}

}  // namespace gapfarm::plan
