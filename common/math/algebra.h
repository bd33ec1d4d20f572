// The decompositions that more than one place needs, compiled once: Eigen makes each anew in every
// file that asks for it.
#pragma once

#include <Eigen/Core>

#include "common/base/ranges.h"

namespace gapfarm {

// What `of` makes of every item, a number each.
template <class Range, class Of>
Eigen::VectorXd vector_of(const Range& range, Of of) {
  const std::vector<double> numbers = mapped(range, of);
  return Eigen::VectorXd::Map(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

struct SymmetricAxes {
  Eigen::VectorXd values;   // ascending
  Eigen::MatrixXd vectors;  // a column each, of unit length
};

// Eigenvalues and -vectors of a symmetric matrix; its lower triangle is read.
SymmetricAxes axes_of_symmetric(const Eigen::MatrixXd& matrix);

// x of A x = b for a symmetric A, positive or negative semidefinite, by L D L'.
Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

// A^-1 of such an A.
Eigen::MatrixXd inverse_of_symmetric(const Eigen::MatrixXd& A);

// x of A x = b for an invertible A, by L U with partial pivoting.
Eigen::VectorXd solve_square(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

// x that makes |A x - b| least, by Q R with column pivoting.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

// Columns x of that kind, one for each of `columns`.
Eigen::MatrixXd least_squares_of(const Eigen::MatrixXd& A, const Eigen::MatrixXd& columns);

// A^+ by Moore and Penrose, of any rank: A^+ b is the shortest x that makes |A x - b| least.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A);

// Orthonormal columns that span those of `columns`, REQUIRES: no more of them than rows.
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& columns);

// The x that makes x' A x / 2 - b' x least within lower <= x <= upper, by an active set: what a
// bound stops is held there and the others are solved for anew.  (A step that is solved for freely
// and clipped afterwards may lead uphill.)
// REQUIRES: A symmetric and positive definite; lower <= upper; infinities are no bounds.
Eigen::VectorXd bounded_minimum(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                                const Eigen::VectorXd& lower, const Eigen::VectorXd& upper);

}  // namespace gapfarm
