#include "master/diagnose/evidence/trend_test.h"

#include <Eigen/Core>
#include <algorithm>
#include <cassert>
#include <set>
#include <utility>
#include <vector>

#include "common/math/algebra.h"
#include "common/math/laws.h"

namespace gapfarm {

Eigen::VectorXd group_means(const Eigen::VectorXd& values, const Eigen::VectorXd& scale,
                            std::span<const int> groups) {
  const int last = groups.empty() ? -1 : *std::max_element(groups.begin(), groups.end());
  std::vector<std::pair<double, double>> sums(static_cast<std::size_t>(last + 1));
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    auto& [value, weight] = sums[static_cast<std::size_t>(groups[static_cast<std::size_t>(i)])];
    value += values[i] / scale[i];
    weight += 1 / (scale[i] * scale[i]);
  }
  Eigen::VectorXd means(values.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const auto& [value, weight] =
        sums[static_cast<std::size_t>(groups[static_cast<std::size_t>(i)])];
    means[i] = value / weight / scale[i];
  }
  return means;
}

TrendTest trend_test(const Eigen::VectorXd& values, const Eigen::MatrixXd& columns,
                     const Eigen::VectorXd& scale, std::span<const int> groups) {
  assert(values.size() == columns.rows() && values.size() == scale.size());
  TrendTest test;
  test.fitted = Eigen::VectorXd::Zero(values.size());
  test.coefficients = Eigen::VectorXd::Zero(columns.cols());
  const std::set<int> distinct(groups.begin(), groups.end());
  const bool means = !groups.empty() && *distinct.begin() >= 0;
  const auto cut = [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
    if (!means) return v;
    return v - group_means(v, scale, groups);
  };
  const Eigen::VectorXd y = cut(values);
  // Columns that hang on those before them, or on the means, are omitted.
  std::vector<Eigen::Index> kept;
  Eigen::MatrixXd basis(values.size(), columns.cols());
  Eigen::MatrixXd used(values.size(), columns.cols());
  for (Eigen::Index j = 0; j < columns.cols(); ++j) {
    const Eigen::VectorXd whole = columns.col(j).cwiseQuotient(scale);
    const Eigen::VectorXd column = cut(whole);
    const auto k = static_cast<Eigen::Index>(kept.size());
    Eigen::VectorXd rest = column;
    for (int twice = 0; twice < 2; ++twice) {
      rest -= basis.leftCols(k) * (basis.leftCols(k).transpose() * rest);
    }
    if (!(rest.squaredNorm() > 1e-6 * whole.squaredNorm())) continue;
    basis.col(k) = rest.normalized();
    used.col(k) = column;
    kept.push_back(j);
  }
  const auto k = static_cast<Eigen::Index>(kept.size());
  const double freedom =
      double(values.size()) - double(k) - (means ? double(distinct.size()) : 0.0);
  if (k == 0 || freedom < 1) return test;
  const Eigen::VectorXd along = basis.leftCols(k).transpose() * y;
  test.fitted = basis.leftCols(k) * along;
  test.squares = along.squaredNorm();
  test.dimensions = static_cast<int>(k);
  const Eigen::VectorXd solved =
      solve_square(basis.leftCols(k).transpose() * used.leftCols(k), along);
  for (Eigen::Index j = 0; j < k; ++j) {
    test.coefficients[kept[static_cast<std::size_t>(j)]] = solved[j];
  }
  const double left = (y - test.fitted).squaredNorm() / freedom;
  if (!(left > 0)) {
    test.p = test.squares > 0 ? 0 : 1;
    return test;
  }
  const double f = test.squares / double(k) / left;
  test.p = fisher_above(double(k), freedom, f);
  return test;
}

}  // namespace gapfarm
