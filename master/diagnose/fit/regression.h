// Least squares with some columns taken out of everything first.
//
// Rows are whitened residuals, three a trial.  A basis holds what has been explained so far; the
// first columns in it are nuisances with a prior (ridge), which is kept as extra rows of zeros in
// the data (one a nuisance), so that projections stay orthogonal.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace gapfarm {

// Sum of squares that columns explain, and their number of effective dimensions.
struct Gain {
  double squares = 0;
  int dimensions = 0;
};

class Regression {
 public:
  // `nuisances` are scaled to prior standard deviation 1.
  Regression(const Eigen::MatrixXd& nuisances, const Eigen::VectorXd& data);

  // What `columns` would explain beyond the basis.  Directions that the basis absorbs but for a
  // share of 1e-4 of their squares do not count.
  Gain gain(const Eigen::MatrixXd& columns) const;
  // The same where coefficients of standard deviation `expected` are nothing to speak of: what the
  // columns explain in units of what they and the noise would make of these.
  Gain gain_beyond(const Eigen::MatrixXd& columns, double expected) const;
  // What a column would explain with a coefficient no farther than these.
  double gain_within(const Eigen::VectorXd& column, double least, double most) const;
  // Squares that each column would explain beyond the basis were it alone.
  Eigen::VectorXd each_gain(const Eigen::SparseMatrix<double>& columns) const;
  // Fisher information of the columns' coefficients beyond the basis.
  Eigen::MatrixXd information(const Eigen::MatrixXd& columns) const;
  // What a column's squares have beyond the basis.
  double own_squares(const Eigen::VectorXd& column) const;
  // The part of the data that `columns` explain beyond the basis.
  Eigen::VectorXd explained(const Eigen::MatrixXd& columns) const;
  // Other data for the same basis.
  void restart(const Eigen::VectorXd& data);
  void add(const Eigen::MatrixXd& columns);

  // What is left of the data: one entry a row (prior rows omitted).
  Eigen::VectorXd left() const { return left_.head(rows_); }
  double left_squares() const { return left_.squaredNorm(); }
  // Degrees of freedom that the basis takes from each row.
  Eigen::VectorXd leverage() const { return basis_.topRows(rows_).rowwise().squaredNorm(); }
  Eigen::Index rows() const { return rows_; }

 private:
  Eigen::MatrixXd cut(const Eigen::MatrixXd& columns) const;
  // Orthonormal directions of cut columns that matter.
  Eigen::MatrixXd directions(const Eigen::MatrixXd& columns) const;

  Eigen::Index rows_;
  Eigen::MatrixXd basis_;
  Eigen::VectorXd left_;
};

}  // namespace gapfarm
