#include "master/diagnose/fit/regression.h"

#include <algorithm>

#include "common/math/algebra.h"

namespace gapfarm {
namespace {

constexpr double kAbsorbed = 1e-4;       // of a column's squares: no longer its own
constexpr double kWeakDirection = 0.02;  // of the strongest singular value

// What cut columns explain of the data; directions of fewer squares than `least` do not count.
Gain gain_of(const Eigen::MatrixXd& c, const Eigen::VectorXd& left, double least, double expected) {
  const SymmetricAxes eigen = axes_of_symmetric(c.transpose() * c);
  const Eigen::VectorXd b = eigen.vectors.transpose() * (c.transpose() * left);
  Gain gain;
  for (Eigen::Index i = 0; i < b.size(); ++i) {
    if (eigen.values[i] <= least) continue;
    gain.squares += b[i] * b[i] / eigen.values[i] / (1 + expected * expected * eigen.values[i]);
    ++gain.dimensions;
  }
  return gain;
}

}  // namespace

Regression::Regression(const Eigen::MatrixXd& nuisances, const Eigen::VectorXd& data)
    : rows_(data.size()) {
  const Eigen::Index k = nuisances.cols();
  Eigen::MatrixXd all(rows_ + k, k);
  all << nuisances, Eigen::MatrixXd::Identity(k, k);
  basis_ = orthonormal(all);
  restart(data);
}

void Regression::restart(const Eigen::VectorXd& data) {
  left_ = Eigen::VectorXd::Zero(basis_.rows());
  left_.head(rows_) = data;
  left_ -= basis_ * (basis_.transpose() * left_);
}

// Columns of unit length, less what the basis holds of them.
Eigen::MatrixXd Regression::cut(const Eigen::MatrixXd& columns) const {
  Eigen::MatrixXd c = Eigen::MatrixXd::Zero(basis_.rows(), columns.cols());
  Eigen::Index kept = 0;
  for (Eigen::Index j = 0; j < columns.cols(); ++j) {
    const double length = columns.col(j).norm();
    if (length > 0) c.col(kept++).head(rows_) = columns.col(j) / length;
  }
  c.conservativeResize(Eigen::NoChange, kept);
  c -= basis_ * (basis_.transpose() * c);
  return c;
}

Gain Regression::gain(const Eigen::MatrixXd& columns) const {
  const Eigen::MatrixXd c = cut(columns);
  return c.cols() == 0 ? Gain() : gain_of(c, left_, kAbsorbed, 0);
}

Gain Regression::gain_beyond(const Eigen::MatrixXd& columns, double expected) const {
  Eigen::MatrixXd c = Eigen::MatrixXd::Zero(basis_.rows(), columns.cols());
  c.topRows(rows_) = columns;
  c -= basis_ * (basis_.transpose() * c);
  return gain_of(c, left_, kAbsorbed * columns.colwise().squaredNorm().mean(), expected);
}

Eigen::VectorXd Regression::each_gain(const Eigen::SparseMatrix<double>& columns) const {
  // The data have nothing of the basis left in them, so neither has their product with a column.
  const Eigen::VectorXd product = columns.transpose() * left_.head(rows_);
  const Eigen::MatrixXd held = columns.transpose() * basis_.topRows(rows_);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(columns.cols());
  for (Eigen::Index j = 0; j < columns.cols(); ++j) {
    const double whole = columns.col(j).squaredNorm();
    const double own = whole - held.row(j).squaredNorm();
    if (own > kAbsorbed * whole) squares[j] = product[j] * product[j] / own;
  }
  return squares;
}

double Regression::gain_within(const Eigen::VectorXd& column, double least, double most) const {
  const double own = own_squares(column), product = column.dot(left_.head(rows_));
  if (!(own > kAbsorbed * column.squaredNorm())) return 0;
  const double c = std::clamp(product / own, least, most);
  return c * (2 * product - c * own);
}

Eigen::MatrixXd Regression::information(const Eigen::MatrixXd& columns) const {
  const Eigen::MatrixXd held = basis_.topRows(rows_).transpose() * columns;
  return columns.transpose() * columns - held.transpose() * held;
}

double Regression::own_squares(const Eigen::VectorXd& column) const {
  return column.squaredNorm() - (basis_.topRows(rows_).transpose() * column).squaredNorm();
}

Eigen::MatrixXd Regression::directions(const Eigen::MatrixXd& columns) const {
  const Eigen::MatrixXd c = cut(columns);
  if (c.cols() == 0) return c;
  const SymmetricAxes eigen = axes_of_symmetric(c.transpose() * c);
  const Eigen::VectorXd& values = eigen.values;  // ascending
  const double least =
      std::max(kAbsorbed, kWeakDirection * kWeakDirection * values[values.size() - 1]);
  Eigen::Index first = 0;
  while (first < values.size() && values[first] <= least) ++first;
  const Eigen::Index count = values.size() - first;
  return c * eigen.vectors.rightCols(count) *
         values.tail(count).cwiseSqrt().cwiseInverse().asDiagonal();
}

Eigen::VectorXd Regression::explained(const Eigen::MatrixXd& columns) const {
  const Eigen::MatrixXd u = directions(columns);
  return u * (u.transpose() * left_);
}

void Regression::add(const Eigen::MatrixXd& columns) {
  Eigen::MatrixXd u = directions(columns);
  if (u.cols() == 0) return;
  // Once more, for the digits lost where little was left of a column.
  u -= basis_ * (basis_.transpose() * u);
  u = orthonormal(u);
  left_ -= u * (u.transpose() * left_);
  const Eigen::Index before = basis_.cols();
  basis_.conservativeResize(Eigen::NoChange, before + u.cols());
  basis_.rightCols(u.cols()) = u;
}

}  // namespace gapfarm
