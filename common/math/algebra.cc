#include "common/math/algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <vector>

namespace gapfarm {
namespace {

enum class At { kFree, kLower, kUpper };

// The free entries' best values, the others being held.
Eigen::VectorXd solve_free(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                           const std::vector<At>& at, Eigen::VectorXd x) {
  std::vector<Eigen::Index> open, held;
  for (Eigen::Index i = 0; i < b.size(); ++i) {
    (at[static_cast<std::size_t>(i)] == At::kFree ? open : held).push_back(i);
  }
  if (open.empty()) return x;
  const Eigen::VectorXd right = b(open) - a(open, held) * x(held);
  const Eigen::MatrixXd among = a(open, open);
  x(open) = solve_symmetric(among, right);
  return x;
}

}  // namespace

SymmetricAxes axes_of_symmetric(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return A.ldlt().solve(b);
}

Eigen::MatrixXd inverse_of_symmetric(const Eigen::MatrixXd& A) {
  return A.ldlt().solve(Eigen::MatrixXd::Identity(A.rows(), A.cols()));
}

Eigen::VectorXd solve_square(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return A.partialPivLu().solve(b);
}

Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return A.colPivHouseholderQr().solve(b);
}

Eigen::MatrixXd least_squares_of(const Eigen::MatrixXd& A, const Eigen::MatrixXd& columns) {
  return A.colPivHouseholderQr().solve(columns);
}

Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A) {
  return A.completeOrthogonalDecomposition().pseudoInverse();
}

Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(columns);
  return qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
}

Eigen::VectorXd bounded_minimum(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                                const Eigen::VectorXd& lower, const Eigen::VectorXd& upper) {
  const Eigen::Index n = b.size();
  std::vector<At> at(static_cast<std::size_t>(n), At::kFree);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n).cwiseMax(lower).cwiseMin(upper);
  // Every round goes downhill from a feasible x, so no set of held entries comes back.
  const Eigen::Index most_rounds = 10 * n + 10;
  for (Eigen::Index round = 0; round < most_rounds; ++round) {
    const Eigen::VectorXd aim = solve_free(a, b, at, x);
    // As far toward the aim as the bounds allow; the first one hit is held.
    double share = 1;
    Eigen::Index hit = -1;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (at[static_cast<std::size_t>(i)] != At::kFree) continue;
      const double bound = aim[i] < lower[i] ? lower[i] : upper[i];
      if (aim[i] >= lower[i] && aim[i] <= upper[i]) continue;
      const double fraction = (bound - x[i]) / (aim[i] - x[i]);
      if (fraction < share) {
        share = fraction;
        hit = i;
      }
    }
    x += share * (aim - x);
    if (hit >= 0) {
      const bool low = aim[hit] < lower[hit];
      x[hit] = low ? lower[hit] : upper[hit];
      at[static_cast<std::size_t>(hit)] = low ? At::kLower : At::kUpper;
      continue;
    }
    // Held entries that downhill leads away from their bound are let go, the steepest first.
    const Eigen::VectorXd down = b - a * x;
    Eigen::Index steepest = -1;
    for (Eigen::Index i = 0; i < n; ++i) {
      const At where = at[static_cast<std::size_t>(i)];
      const double inward = where == At::kLower ? down[i] : where == At::kUpper ? -down[i] : 0;
      if (inward <= 1e-12 * (1 + std::abs(b[i]))) continue;
      if (steepest < 0 || inward > std::abs(down[steepest])) steepest = i;
    }
    if (steepest < 0) break;
    at[static_cast<std::size_t>(steepest)] = At::kFree;
  }
  return x;
}

}  // namespace gapfarm
