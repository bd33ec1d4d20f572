#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "common/base/hash.h"
#include "common/math/algebra.h"
#include "common/math/statistics.h"
#include "common/random/stream.h"
#include "common/robot/robot.h"
#include "master/ground/fit/held_out.h"
#include "master/ground/fit/window_fit.h"
#include "master/ground/tolerances.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// Of every row's variance, of the middle one's: candidates.
constexpr double kLeastNoises[] = {0.1, 0.3, 1, 3, 10, 100};
constexpr double kLeastCurvature = 0.3;  // of the weights; of Student's own residuals 0.71

void add_pose(const Pose& X, Hasher* hasher) { hasher->add(X.x).add(X.y).add(X.theta); }

}  // namespace

std::string question_of(const GroundRobot& robot, const WindowSet& windows,
                        const std::optional<GroundReference>& reference) {
  Hasher hasher;
  hasher.add(format_robot(robot));
  for (const CommandedRun& run : windows.runs) {
    hasher.add(run.start_s).add(run.speed_m_s).add(run.turn_rad_s);
    add_rows(run.commands, &hasher);
  }
  for (std::size_t i = 0; i < windows.trials.size(); ++i) {
    const Trial& trial = windows.trials[i];
    hasher.add(*trial.t_s).add(*trial.duration_s).add(std::uint64_t{*trial.run});
    add_pose(trial.X_WS, &hasher);
    add_pose(trial.X_WE, &hasher);
  }
  for (const Eigen::Matrix3d& noise : windows.noise) {
    for (Eigen::Index k = 0; k < noise.size(); ++k) hasher.add(noise(k));
  }
  hasher.add(windows.least_noise);
  for (const double turned : windows.turned_rad) hasher.add(turned);
  for (const Return& back : windows.returns) {
    for (const double variance : back.variance) hasher.add(variance);
  }
  for (std::size_t k = 0; reference && k < reference->names.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    hasher.add(reference->names[k]).add(reference->values[i]);
    for (Eigen::Index j = 0; j <= i; ++j) hasher.add(reference->covariance(i, j));
  }
  return hasher.finish();
}

std::string WindowFitter::key_of(const std::vector<FitRow>& rows, const std::vector<char>& held_out,
                                 const Eigen::VectorXd& start, int rounds) const {
  Hasher hasher;
  hasher.add(question_).add(static_cast<std::uint64_t>(rounds));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    hasher.add(rows[k].row.name).add(rows[k].row.nominal).add(rows[k].row.tolerance);
    hasher.add(rows[k].row.farthest);
    hasher.add(std::uint64_t{rows[k].free}).add(start[k]);
  }
  hasher.add(std::string_view(held_out.data(), held_out.size()));
  return hasher.finish();
}

Eigen::Index WindowFitter::in_reference(const FitRow& row) const {
  return !reference_ ? -1 : reference_->index(row.row.name);
}

std::vector<FitRow> all_free(std::vector<FitRow> rows) {
  for (FitRow& row : rows) row.free = true;
  return rows;
}

bool GroundReference::leaves_open(const std::vector<KinematicRow>& rows) const {
  return std::ranges::any_of(rows, [&](const KinematicRow& row) {
    const auto found = std::ranges::find(names, row.name);
    return found != names.end() && !shown[static_cast<std::size_t>(found - names.begin())];
  });
}

double prior_deviation(const FitRow& row) {
  if (!row.free) return row.row.tolerance;
  return row.row.farthest > 0 ? row.row.farthest : plausible_error(row.row);
}

Eigen::MatrixXd WindowFitter::prior_precision(const std::vector<FitRow>& rows) const {
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    covariance(k, k) = std::pow(prior_deviation(rows[k]), 2);
  }
  if (!reference_) return covariance.diagonal().cwiseInverse().asDiagonal();
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::Index a = in_reference(rows[k]);
    for (Eigen::Index l = 0; a >= 0 && l < n; ++l) {
      const Eigen::Index b = in_reference(rows[l]);
      if (b >= 0) covariance(k, l) += reference_->covariance(a, b);
    }
  }
  return inverse_of_symmetric(covariance);
}

double WindowFitter::prior(const WindowFit& fit) const {
  if (fit.rows.empty()) return 0;
  const Eigen::VectorXd away = fit.values - nominals(fit.rows);
  return -away.dot(prior_precision(fit.rows) * away) / 2;
}

// Of every horizon and component: the mean curvature of the windows' log density over their mean
// weight.  Weights are held while one step is made, and residuals' weights fall as they grow: a
// step by weights alone would stop short of where a drawn log has its values.
std::vector<Eigen::Vector3d> WindowFitter::curvature_shares(const WindowFit& fit) const {
  const auto n = static_cast<std::size_t>(windows_.horizons);
  std::vector<Eigen::Vector3d> weights(n, Eigen::Vector3d::Zero()), curvatures = weights;
  for (std::size_t i = 0; i < fit.residuals.size(); ++i) {
    const auto h = static_cast<std::size_t>(windows_.horizon[i]);
    for (Eigen::Index c = 0; c < 3; ++c) {
      const double s = fit.scales[h][c], squares = std::pow(fit.residuals[i][c] / s, 2);
      const double weight = window_weight(fit.residuals[i][c], s);
      weights[h][c] += weight;
      curvatures[h][c] += weight * (kWindowTail - squares) / (kWindowTail + squares);
    }
  }
  for (std::size_t h = 0; h < n; ++h) {
    curvatures[h] = curvatures[h].cwiseQuotient(weights[h]).cwiseMax(kLeastCurvature);
  }
  return curvatures;
}

Eigen::MatrixXd WindowFitter::draws(const WindowFit& fit, std::uint64_t seed, bool all) const {
  const Eigen::Index n = fit.values.size();
  const std::vector<Equations> blocks = equations_of_blocks(fit);
  const Eigen::MatrixXd P = prior_precision(fit.rows);
  const Eigen::VectorXd away = fit.values - nominals(fit.rows);
  const std::vector<std::vector<double>> all_times =
      draw_blocks(windows_, seed, /*of_values=*/true);
  Eigen::MatrixXd drawn(n, kDraws);
  Stream stream({seed, Purpose::kStatistics, 4, 0, 0});
  for (int d = 0; d < kDraws; ++d) {
    Eigen::VectorXd from = away;
    for (Eigen::Index k = 0; k < n; ++k) {
      const FitRow& row = fit.rows[k];
      const Eigen::Index a = in_reference(row);
      if (a >= 0) from[k] -= reference_->draws(a, d);
      if (a < 0 && (row.free || all)) from[k] -= stream.normal() / std::sqrt(P(k, k));
    }
    Eigen::MatrixXd A = P;
    Eigen::VectorXd b = P * from;
    const std::vector<double>& times = all_times[d];
    for (std::size_t k = 0; k < blocks.size(); ++k) {
      A += times[k] * blocks[k].H;
      b += times[k] * blocks[k].g;
    }
    drawn.col(d) = fit.values - solve_symmetric(A, b);
  }
  return drawn;
}

Eigen::MatrixX2d WindowFitter::intervals(const WindowFit& fit, std::uint64_t seed) const {
  const Eigen::MatrixXd drawn = draws(fit, seed);
  Eigen::MatrixX2d bounds(drawn.rows(), 2);
  for (Eigen::Index k = 0; k < drawn.rows(); ++k) {
    const Eigen::Index a = in_reference(fit.rows[k]);
    std::vector<double> row(drawn.cols());
    for (Eigen::Index d = 0; d < drawn.cols(); ++d) {
      row[d] = drawn(k, d) - (a >= 0 ? reference_->draws(a, d) : 0);
    }
    const auto [lo, hi] = interval_about(fit.values[k], std::move(row));
    bounds.row(k) << lo, hi;
  }
  return bounds;
}

namespace {

// Of what is stated, of each horizon and component.
std::vector<double> middle_variances(const WindowSet& windows) {
  std::vector<std::vector<double>> variances(3 * static_cast<std::size_t>(windows.horizons));
  for (std::size_t i = 0; i < windows.noise.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      variances[3 * static_cast<std::size_t>(windows.horizon[i]) + c].push_back(
          windows.noise[i](c, c));
    }
  }
  std::vector<double> middle;
  for (const std::vector<double>& v : variances) middle.push_back(v.empty() ? 1 : median(v));
  return middle;
}

}  // namespace

// What a row states counts as far as it makes it more or less sure than others: common scales stay
// free, and no row is surer than slip and rounding leave any.
std::vector<Eigen::Matrix3d> WindowFitter::noise_shapes(double least) const {
  const std::vector<Eigen::Matrix3d>& noise = windows_.noise;
  const std::vector<double> middle = middle_variances(windows_);
  std::vector<Eigen::Matrix3d> shapes;
  for (std::size_t i = 0; i < noise.size(); ++i) {
    const double* m = &middle[3 * static_cast<std::size_t>(windows_.horizon[i])];
    const Eigen::Vector3d unit = Eigen::Vector3d(m[0], m[1], m[2]).cwiseSqrt();
    Eigen::Matrix3d C = unit.cwiseInverse().asDiagonal() * noise[i];
    C = (C * unit.cwiseInverse().asDiagonal()).eval();
    C = (C + least * Eigen::Matrix3d::Identity()) / (1 + least);
    const SymmetricAxes axes = axes_of_symmetric(C);
    const Eigen::Matrix3d root = axes.vectors *
                                 axes.values.cwiseSqrt().cwiseInverse().asDiagonal() *
                                 axes.vectors.transpose();
    shapes.push_back(unit.asDiagonal() * root * unit.cwiseInverse().asDiagonal());
  }
  return shapes;
}

WindowFit WindowFitter::shaped(WindowFit fit, const std::vector<Eigen::Vector3d>& raw,
                               const std::vector<Eigen::Matrix3d>& shapes,
                               const std::vector<double>& use) const {
  fit.residuals = raw;
  for (std::size_t i = 0; i < shapes.size(); ++i) fit.residuals[i] = shapes[i] * raw[i];
  fit.scales.clear();
  rescale(&fit, use);
  score(&fit, use);
  return fit;
}

double WindowFitter::nats_shaped(const WindowFit& fit, const std::vector<Eigen::Vector3d>& raw,
                                 const std::vector<Eigen::Matrix3d>& shapes) const {
  const std::vector<double> use = uses({});
  double volumes = 0;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    volumes += use[i] * std::log(shapes[i].determinant());
  }
  return shaped(fit, raw, shapes, use).objective + volumes;
}

double WindowFitter::likeliest_least_noise(const WindowFit& fit) const {
  double best = windows_.least_noise, most = -INFINITY;
  if (windows_.noise.empty() || shapes_.empty()) return best;
  const std::vector<Eigen::Vector3d> raw = raw_residuals(fit);
  // What is stated is this factor too small at most: the rest is not the matcher's.
  const WindowFit plain = shaped(fit, raw, {}, uses({}));
  const std::vector<double> middle = middle_variances(windows_);
  std::vector<double> ratios;
  for (std::size_t k = 0; k < 3 * static_cast<std::size_t>(windows_.lengths); ++k) {
    const double scale = plain.scales[k / 3][k % 3];
    ratios.push_back(scale * scale / (kMostTooSmall * kMostTooSmall * middle[k]));
  }
  const double lowest = median(ratios) - 1;
  for (const double candidate : kLeastNoises) {
    const double least = std::max(candidate, lowest);
    const double objective = nats_shaped(fit, raw, noise_shapes(least));
    if (objective <= most) continue;
    most = objective;
    best = least;
  }
  return best;
}

std::vector<EndedWindow> WindowFitter::ended_windows(const WindowFit& fit) const {
  const std::vector<Eigen::Vector3d> raw = raw_residuals(fit);
  const std::vector<Eigen::MatrixXd> J = slopes(fit);
  std::vector<EndedWindow> ended;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    if (windows_.sense_of(i) != Sense::kPose) continue;
    ended.push_back({static_cast<std::size_t>(windows_.horizon[i]), *windows_.trials[i].duration_s,
                     windows_.run_of[i], raw[i],
                     shapes_.empty() ? J[i] : Eigen::MatrixXd(shapes_[i].inverse() * J[i])});
  }
  return ended;
}

}  // namespace gapfarm
