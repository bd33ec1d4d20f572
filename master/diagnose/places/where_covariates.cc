#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>
#include <utility>

#include "common/math/algebra.h"
#include "common/math/laws.h"
#include "common/pose/pose.h"
#include "master/diagnose/places/where.h"

namespace gapfarm {

void add_covariate(WhereCovariate covariate, std::span<const ResidualTrial> trials,
                   const std::vector<Feature>& features, std::vector<WhereCovariate>* all) {
  covariate.columns.resize(trials.size(), features.size());
  for (std::size_t k = 0; k < features.size(); ++k) {
    for (std::size_t i = 0; i < trials.size(); ++i) {
      covariate.columns(i, k) = features[k](trials[i]);
    }
  }
  covariate.columns.rowwise() -= covariate.columns.colwise().mean().eval();
  all->push_back(std::move(covariate));
}

std::vector<Feature> session_features(std::span<const ResidualTrial> trials) {
  const auto last = static_cast<std::size_t>(max_of(trials, &ResidualTrial::session));
  std::vector<Feature> features;
  for (std::size_t s = 1; s <= last; ++s) {
    features.push_back([s](const ResidualTrial& t) { return t.session == s ? 1.0 : 0.0; });
  }
  return features;
}

std::vector<WhereCovariate> where_covariates(std::span<const ResidualTrial> trials,
                                             std::span<const Eigen::Vector3d> residuals,
                                             std::span<const Cell> cells) {
  using T = const ResidualTrial&;
  std::vector<WhereCovariate> all;
  const auto add = [&](WhereCovariate covariate, const std::vector<Feature>& features) {
    add_covariate(std::move(covariate), trials, features, &all);
  };
  add({"time", {}, true, true, 60, "with every minute of the session"},
      {[](T t) { return t.context.session_time_s; }});
  add({"duration", {}, false, false, 1, "with every second that the command lasts"},
      {[&](T t) { return cells[t.cell].command.duration_s; }});
  add({"level", {}, false, false, 0.1, "with every tenth of the level"},
      {[&](T t) { return cells[t.cell].level; }});
  add({"place in run", {}, true, true, 1, "with every trial since the robot was put down"},
      {[](T t) { return double(t.context.place_in_run); }});
  add({"direction change"},
      {[&](T t) { return t.context.last_left * cells[t.cell].command.left < 0 ? 1.0 : 0.0; },
       [&](T t) { return t.context.last_right * cells[t.cell].command.right < 0 ? 1.0 : 0.0; }});
  for (const auto& [order, name] : {std::pair(1, "start heading"),
                                    {2, "start heading, 2nd harmonic"},
                                    {4, "start heading, 4th harmonic"}}) {
    add({name, {}, true}, harmonics([order](T t) { return order * t.X_WS.theta; }, 1));
  }
  Extent box;
  for (T t : trials) box.add(t.X_WS);
  const double x = (box.x0 + box.x1) / 2, y = (box.y0 + box.y1) / 2;
  add({"start x", {}, true, true, 0.1, "with every 100 mm that they start farther along x"},
      {[=](T t) { return t.X_WS.x - x; }});
  add({"start y", {}, true, true, 0.1, "with every 100 mm that they start farther along y"},
      {[=](T t) { return t.X_WS.y - y; }});
  const std::string away = "with every 100 mm that they start farther from the arena's middle";
  add({"radius from the middle", {}, true, true, 0.1, away},
      {[=](T t) { return std::hypot(t.X_WS.x - x, t.X_WS.y - y); }});
  if (const auto sessions = session_features(trials); !sessions.empty()) {
    add({"session", {}, true}, sessions);
  }
  std::vector<Feature> before;
  for (int k = 0; k < 3; ++k) {
    before.push_back([=](T t) {
      return t.context.previous && !t.context.moved ? residuals[*t.context.previous][k] : 0;
    });
  }
  add({"previous residual"}, before);
  add({"unrecorded move", {}, true, true, 1, "when the robot was put down by hand just before"},
      {[](T t) { return t.context.moved ? 1.0 : 0.0; }});
  return all;
}

Eigen::VectorXd group_means(const Eigen::VectorXd& values, const Eigen::VectorXd& scale,
                            std::span<const int> groups) {
  const int last = groups.empty() ? -1 : *std::max_element(groups.begin(), groups.end());
  std::vector<std::pair<double, double>> sums(last + 1);
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    auto& [value, weight] = sums[groups[i]];
    value += values[i] / scale[i];
    weight += 1 / (scale[i] * scale[i]);
  }
  Eigen::VectorXd means(values.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const auto& [value, weight] = sums[groups[i]];
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
    test.coefficients[kept[j]] = solved[j];
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
