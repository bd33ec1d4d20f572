#include "master/diagnose/places/where_covariates.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>
#include <utility>

#include "common/math/algebra.h"
#include "common/math/laws.h"
#include "common/pose/pose.h"

namespace gapfarm {
namespace {

std::vector<double> middle(std::span<const ResidualTrial> trials) {
  Extent box;
  for (const ResidualTrial& t : trials) box.add(t.X_WS);
  return {(box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2};
}

}  // namespace

void add_covariate(WhereCovariate covariate, std::size_t trials,
                   const std::function<std::vector<double>(std::size_t)>& values,
                   std::vector<WhereCovariate>* all) {
  covariate.columns.resize(trials, static_cast<Eigen::Index>(values(0).size()));
  for (std::size_t i = 0; i < trials; ++i) {
    const std::vector<double> row = values(i);
    covariate.columns.row(i) =
        Eigen::Map<const Eigen::RowVectorXd>(row.data(), covariate.columns.cols());
  }
  covariate.columns.rowwise() -= covariate.columns.colwise().mean().eval();
  all->push_back(std::move(covariate));
}

std::vector<WhereCovariate> where_covariates(std::span<const ResidualTrial> trials,
                                             std::span<const Eigen::Vector3d> residuals,
                                             std::span<const Cell> cells) {
  std::vector<WhereCovariate> all;
  const auto add = [&](WhereCovariate covariate,
                       const std::function<std::vector<double>(std::size_t)>& values) {
    add_covariate(std::move(covariate), trials.size(), values, &all);
  };
  using V = std::vector<double>;
  const auto& t = trials;
  const auto cell = [&](std::size_t i) -> const Cell& { return cells[t[i].cell]; };
  add({"time", {}, true, true, 60, "with every minute of the session"},
      [&](std::size_t i) { return V{t[i].context.session_time_s}; });
  add({"duration", {}, false, false, 1, "with every second that the command lasts"},
      [&](std::size_t i) { return V{cell(i).command.duration_s}; });
  add({"level", {}, false, false, 0.1, "with every tenth of the level"},
      [&](std::size_t i) { return V{cell(i).level}; });
  add({"place in run", {}, true, true, 1, "with every trial since the robot was put down"},
      [&](std::size_t i) { return V{double(t[i].context.place_in_run)}; });
  add({"direction change", {}}, [&](std::size_t i) {
    return V{t[i].context.last_left * cell(i).command.left < 0 ? 1.0 : 0.0,
             t[i].context.last_right * cell(i).command.right < 0 ? 1.0 : 0.0};
  });
  const char* const heading[] = {"start heading", "start heading, 2nd harmonic",
                                 "start heading, 4th harmonic"};
  for (int h = 0; h < 3; ++h) {
    const int order = 1 << h;
    add({heading[h], {}, true}, [&t, order](std::size_t i) {
      return V{std::cos(order * t[i].X_WS.theta), std::sin(order * t[i].X_WS.theta)};
    });
  }
  const V centre = middle(trials);
  add({"start x", {}, true, true, 0.1, "with every 100 mm that they start farther along x"},
      [&](std::size_t i) { return V{t[i].X_WS.x - centre[0]}; });
  add({"start y", {}, true, true, 0.1, "with every 100 mm that they start farther along y"},
      [&](std::size_t i) { return V{t[i].X_WS.y - centre[1]}; });
  add({"radius from the middle",
       {},
       true,
       true,
       0.1,
       "with every 100 mm that they start farther from the arena's middle"},
      [&](std::size_t i) {
        return V{std::hypot(t[i].X_WS.x - centre[0], t[i].X_WS.y - centre[1])};
      });
  std::size_t sessions = 0;
  for (const ResidualTrial& trial : t) sessions = std::max(sessions, trial.session + 1);
  if (sessions > 1) {
    add({"session", {}, true}, [&](std::size_t i) {
      V one(sessions - 1, 0.0);
      if (t[i].session > 0) one[t[i].session - 1] = 1;
      return one;
    });
  }
  add({"previous residual", {}}, [&](std::size_t i) {
    const auto& before = t[i].context.previous;
    if (!before || t[i].context.moved) return V{0, 0, 0};
    const Eigen::Vector3d& r = residuals[*before];
    return V{r[0], r[1], r[2]};
  });
  add({"unrecorded move", {}, true, true, 1, "when the robot was put down by hand just before"},
      [&](std::size_t i) { return V{t[i].context.moved ? 1.0 : 0.0}; });
  return all;
}

Eigen::VectorXd group_means(const Eigen::VectorXd& values, const Eigen::VectorXd& scale,
                            std::span<const int> groups) {
  const int last = groups.empty() ? -1 : *std::max_element(groups.begin(), groups.end());
  std::vector<std::pair<double, double>> sums(last + 1);
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    auto& [value, weight] = sums[static_cast<std::size_t>(groups[i])];
    value += values[i] / scale[i];
    weight += 1 / (scale[i] * scale[i]);
  }
  Eigen::VectorXd means(values.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const auto& [value, weight] = sums[static_cast<std::size_t>(groups[i])];
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
