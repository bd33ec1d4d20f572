#include "master/residual/basis.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/score/algebra.h"
#include "common/score/statistics.h"

namespace gapfarm {
namespace {

constexpr double kSpacing = 0.7;  // of centres, in lengths
constexpr std::size_t kMostOfCommand = 24;
constexpr std::size_t kMostOfAll = 40;
constexpr double kJitter = 1e-6;
// Standard deviations beyond which a trial pulls no harder.
constexpr double kFarthestPull = 10;

// The point at which a covariate is looked at, in lengths; angles as points of a circle.
Eigen::VectorXd scaled_point(const ResidualTerm& term, const LoggedMotion& facts,
                             const Pose& X_WR) {
  const auto known = residual_covariates();
  Eigen::VectorXd point(static_cast<Eigen::Index>(2 * term.covariates.size()));
  point.setZero();
  for (std::size_t j = 0; j < term.covariates.size(); ++j) {
    const ResidualCovariate& covariate = known[term.covariates[j]];
    const double value = covariate.value(facts, X_WR);
    const auto at = static_cast<Eigen::Index>(2 * j);
    if (covariate.cyclic) {
      point[at] = std::cos(value) / term.lengths[j];
      point[at + 1] = std::sin(value) / term.lengths[j];
    } else {
      point[at] = value / term.lengths[j];
    }
  }
  return point;
}

Eigen::Matrix3d noise_of(const Eigen::Matrix3d& whitener) {
  return inverse_of_symmetric(whitener.transpose() * whitener);
}

}  // namespace

ResidualBasis::ResidualBasis(const ResidualData& data, const std::vector<bool>& seen,
                             const ResidualShape& shape, const std::vector<double>& lengths)
    : data_(data) {
  term_.frame = shape.frame;
  term_.by_drive = shape.by_drive;
  term_.covariates = shape.covariates;
  std::map<std::string, std::size_t> groups;
  for (std::size_t i = 0; i < data.size(); ++i) {
    const std::string name = shape.by_command ? data.facts[i].command : "";
    const auto [at, fresh] = groups.try_emplace(name, groups_.size());
    if (fresh) {
      groups_.push_back(name);
      of_group_.emplace_back();
    }
    of_group_[at->second].push_back(i);
  }
  place_centres(seen, lengths);
  if (!useful_) return;
  std::vector<double> drives, noises[3];
  for (std::size_t i = 0; i < data.size(); ++i) {
    features_.push_back(residual_features(term_, data.facts[i], data.ends[i]));
    turned_.push_back(residual_axes(term_.frame, data.facts[i].X_WS, data.ends[i]));
    axes_.push_back(data.whiteners[i] * turned_.back());
    drives.push_back(drive_s(data.facts[i]));
    const Eigen::Matrix3d noise = noise_of(data.whiteners[i]);
    for (int k = 0; k < 3; ++k) noises[k].push_back(std::sqrt(noise(k, k)));
  }
  for (int k = 0; k < 3; ++k) unit_[k] = median(noises[k]);
  unit_[0] = unit_[1] = std::max(unit_[0], unit_[1]);
  if (term_.by_drive) unit_ /= std::max(1e-6, median(drives));
  if (term_.frame == ResidualFrame::kMotion) {
    std::vector<double> ways, turns;
    for (const Eigen::Matrix3d& motion : turned_) {
      ways.push_back(std::hypot(motion(0, 0), motion(1, 1)));
      turns.push_back(std::abs(motion(2, 2)));
    }
    unit_.head<2>() /= std::max(1e-3, median(ways));
    unit_[2] /= std::max(1e-2, quantile(turns, 0.75));
  }
}

// Greedily the trial farthest from all centres so far, until every trial is near one.
void ResidualBasis::place_centres(const std::vector<bool>& seen,
                                  const std::vector<double>& lengths) {
  const auto known = residual_covariates();
  const bool readings = term_.frame == ResidualFrame::kReadings;
  std::vector<std::pair<const LoggedMotion*, Pose>> places;
  for (std::size_t i = 0; i < data_.size(); ++i) {
    if (!seen[i]) continue;
    places.emplace_back(&data_.facts[i], data_.facts[i].X_WS);
    if (readings) places.emplace_back(&data_.facts[i], data_.ends[i]);
  }
  for (const std::size_t row : term_.covariates) {
    double least = INFINITY, most = -INFINITY;
    for (const auto& [facts, X] : places) {
      least = std::min(least, known[row].value(*facts, X));
      most = std::max(most, known[row].value(*facts, X));
    }
    const bool flag = std::string_view(known[row].name).ends_with("_reversed") ||
                      std::string_view(known[row].name) == "moved";
    const double range = known[row].cyclic || flag ? 1 : most - least;
    // What does not vary does not matter.
    const double length = lengths[term_.lengths.size()] * range;
    term_.lengths.push_back(range > 1e-6 ? std::round(length * 1e4) / 1e4 : 1);
  }
  std::vector<Eigen::VectorXd> points;
  for (const auto& [facts, X] : places) points.push_back(scaled_point(term_, *facts, X));
  const std::size_t most = groups_.size() > 1 ? kMostOfCommand : kMostOfAll;
  std::vector<std::size_t> centres;
  std::vector<double> away(points.size(), INFINITY);
  for (std::size_t next = 0; !points.empty() && centres.size() < most;) {
    centres.push_back(next);
    for (std::size_t p = 0; p < points.size(); ++p) {
      away[p] = std::min(away[p], (points[p] - points[next]).norm());
    }
    next = static_cast<std::size_t>(std::max_element(away.begin(), away.end()) - away.begin());
    if (away[next] < kSpacing) break;
  }
  const bool constant = centres.size() < 2;
  useful_ = !centres.empty() && !(constant && readings);
  term_.centres.resize(static_cast<Eigen::Index>(centres.size()),
                       static_cast<Eigen::Index>(term_.covariates.size()));
  kernel_.resize(term_.centres.rows(), term_.centres.rows());
  for (std::size_t k = 0; k < centres.size(); ++k) {
    const auto& [facts, X] = places[centres[k]];
    const auto row = static_cast<Eigen::Index>(k);
    for (std::size_t j = 0; j < term_.covariates.size(); ++j) {
      const double value = known[term_.covariates[j]].value(*facts, X);
      term_.centres(row, static_cast<Eigen::Index>(j)) = std::round(value * 1e4) / 1e4;
    }
    for (std::size_t l = 0; l < centres.size(); ++l) {
      const double d2 = (points[centres[k]] - points[centres[l]]).squaredNorm();
      kernel_(row, static_cast<Eigen::Index>(l)) = std::exp(-0.5 * d2);
    }
  }
  kernel_.diagonal().array() += kJitter;
}

ResidualBasis::Normal ResidualBasis::normal_of(std::size_t group, const Residuals& residuals,
                                               const std::vector<bool>& learn) const {
  const Eigen::Index k = kernel_.rows(), parts = components();
  Normal normal{Eigen::MatrixXd::Zero(parts * k, parts * k), Eigen::VectorXd::Zero(parts * k)};
  for (const std::size_t i : of_group_[group]) {
    if (!learn[i]) continue;
    Eigen::Vector3d z = data_.whiteners[i] * residuals[i];
    const double far = z.norm();
    if (far > kFarthestPull) z *= kFarthestPull / far;
    const Eigen::Matrix3d inner = axes_[i].transpose() * axes_[i];
    const Eigen::Vector3d pull = axes_[i].transpose() * z;
    const Eigen::MatrixXd outer = features_[i] * features_[i].transpose();
    for (Eigen::Index a = 0; a < parts; ++a) {
      for (Eigen::Index b = 0; b < parts; ++b) {
        if (inner(a, b) != 0) normal.matrix.block(a * k, b * k, k, k) += inner(a, b) * outer;
      }
      normal.right.segment(a * k, k) += pull[a] * features_[i];
    }
  }
  return normal;
}

Eigen::MatrixXd ResidualBasis::solve(const Normal& normal, double amplitude) const {
  const Eigen::Index k = kernel_.rows(), parts = components();
  Eigen::MatrixXd matrix = normal.matrix;
  for (Eigen::Index a = 0; a < parts; ++a) {
    const double sd = amplitude * unit_[a];
    matrix.block(a * k, a * k, k, k) += kernel_ / (sd * sd);
  }
  // Shifts are told in um and urad; scaled alike, metres and radians are solved alike.
  const Eigen::VectorXd solved = solve_symmetric(matrix, normal.right);
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(k, 3);
  for (Eigen::Index a = 0; a < parts; ++a) weights.col(a) = solved.segment(a * k, k);
  return weights;
}

Eigen::Vector3d ResidualBasis::shift(std::size_t trial, const Eigen::MatrixXd& weights) const {
  return turned_[trial] * (weights.transpose() * features_[trial]);
}

ResidualTerm ResidualBasis::fit(const Residuals& residuals, const std::vector<bool>& learn,
                                double amplitude) const {
  ResidualTerm term = term_;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    Eigen::MatrixXd weights = solve(normal_of(g, residuals, learn), amplitude);
    weights = (weights * 1e6).array().round() / 1e6;
    term.weights.push_back({groups_[g], std::move(weights)});
  }
  return term;
}

std::vector<Residuals> ResidualBasis::shifts(const Residuals& residuals,
                                             const std::vector<bool>& learn,
                                             const std::vector<double>& amplitudes,
                                             const std::vector<bool>& wanted) const {
  std::vector<Residuals> all(amplitudes.size(), Residuals(data_.size(), Eigen::Vector3d::Zero()));
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const Normal normal = normal_of(g, residuals, learn);
    for (std::size_t a = 0; a < amplitudes.size(); ++a) {
      const Eigen::MatrixXd weights = solve(normal, amplitudes[a]);
      for (const std::size_t i : of_group_[g]) {
        if (wanted[i]) all[a][i] = shift(i, weights);
      }
    }
  }
  return all;
}

Residuals ResidualBasis::shifts_of(const ResidualTerm& term) const {
  Residuals all(data_.size(), Eigen::Vector3d::Zero());
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    for (const std::size_t i : of_group_[g]) all[i] = shift(i, term.weights[g].shifts);
  }
  return all;
}

}  // namespace gapfarm
