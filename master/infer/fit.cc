#include "master/infer/fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/try.h"
#include "common/math/algebra.h"

namespace gapfarm::infer {
namespace {

constexpr int kMostHalvings = 3;
constexpr double kFirstDifference = 0.2;  // of a coordinate
constexpr double kLeastDifference = 0.01, kMostDifference = 1.5;
constexpr double kLeastDamping = 1e-3;

double weight(double squares, double scale) {
  return (kTail + 3) / (kTail * scale * scale + squares);
}

double score_of(double squares, double scale) {
  return -3 * std::log(scale) - (kTail + 3) / 2 * std::log1p(squares / (kTail * scale * scale));
}

double squares_of(const Eigen::VectorXd& z, Eigen::Index i) {
  return z.segment<3>(3 * i).squaredNorm();
}

}  // namespace

double robust_score(const Eigen::VectorXd& z, double scale) {
  double sum = 0;
  for (Eigen::Index i = 0; i < z.size() / 3; ++i) sum += score_of(squares_of(z, i), scale);
  return sum;
}

double best_scale(const Eigen::VectorXd& z, double least, double most) {
  if (z.size() == 0) return 1;
  // The likelihood's own fixed point, which rises with every round (expectation, maximisation).
  double scale =
      std::clamp(std::sqrt(z.squaredNorm() / static_cast<double>(z.size())), least, most);
  for (int round = 0; round < 60; ++round) {
    double sum = 0;
    for (Eigen::Index i = 0; i < z.size() / 3; ++i) {
      const double squares = squares_of(z, i);
      sum += weight(squares, scale) * squares * scale * scale;
    }
    const double next = std::clamp(std::sqrt(sum / static_cast<double>(z.size())), least, most);
    const bool same = std::abs(next - scale) < 1e-4 * scale;
    scale = next;
    if (same) break;
  }
  return scale;
}

Fitter::Fitter(const Forward& forward, const Observations& observations, Space space)
    : forward_(forward), observations_(observations), space_(std::move(space)) {}

Eigen::Vector3d Fitter::residual(std::size_t i, const Pose& end) const {
  return observations_.whitener[i] * local_difference(end, observations_.measured[i]);
}

Eigen::VectorXd Fitter::whitened(const std::vector<Pose>& ends) const {
  Eigen::VectorXd z(static_cast<Eigen::Index>(3 * ends.size()));
  for (std::size_t i = 0; i < ends.size(); ++i) {
    z.segment<3>(static_cast<Eigen::Index>(3 * i)) = residual(i, ends[i]);
  }
  return z;
}

Eigen::VectorXd Fitter::beside(const Eigen::VectorXd& u) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * observations_.size()));
  Eigen::Index k = 0;
  for (const Coordinate& c : space_.all()) {
    if (c.kind == Coordinate::Kind::kColumn && u[k] != 0) {
      sum -= u[k] * observations_.columns.col(static_cast<Eigen::Index>(c.row));
    }
    k += c.dimensions();
  }
  return sum;
}

void Fitter::judge(Eigen::VectorXd z, Fit* fit) const {
  fit->z = std::move(z);
  fit->scale = best_scale(fit->z, observations_.least_scale, observations_.most_scale);
  fit->score = robust_score(fit->z, fit->scale) - 0.5 * fit->u.cwiseAbs2().dot(space_.prior());
}

Result<std::vector<Fit>> Fitter::starts(const std::vector<Eigen::VectorXd>& points,
                                        const std::vector<Space>& spaces,
                                        const std::vector<std::vector<std::uint32_t>>& reach,
                                        const Eigen::VectorXd& elsewhere) const {
  std::vector<PredictionRequest> requests;
  for (std::size_t k = 0; k < points.size(); ++k) {
    requests.push_back(
        {spaces[k].values(points[k]), reach.empty() ? std::vector<std::uint32_t>() : reach[k]});
  }
  ASSIGN_OR_RETURN(const auto ends, forward_(requests));
  std::vector<Fit> fits(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    fits[k].u = points[k];
    if (!ends[k]) continue;
    const std::vector<std::uint32_t>& some = requests[k].trials;
    if (some.empty()) {
      judge(whitened(*ends[k]) + beside(points[k]), &fits[k]);
      continue;
    }
    Eigen::VectorXd z = elsewhere;
    const Eigen::VectorXd linear = beside(points[k]);
    for (std::size_t j = 0; j < some.size(); ++j) {
      const auto at = static_cast<Eigen::Index>(3 * some[j]);
      z.segment<3>(at) = residual(some[j], (*ends[k])[j]) + linear.segment<3>(at);
    }
    judge(std::move(z), &fits[k]);
  }
  return fits;
}

Result<Fit> Fitter::start(const Eigen::VectorXd& u) const {
  ASSIGN_OR_RETURN(auto fits, starts({u}, {space_}));
  return std::move(fits.front());
}

// Of every dimension; -1: it is a parameter's.
std::vector<Eigen::Index> Fitter::columns_of_dimensions() const {
  std::vector<Eigen::Index> columns;
  for (const Coordinate& c : space_.all()) {
    const bool is_column = c.kind == Coordinate::Kind::kColumn;
    columns.insert(columns.end(), static_cast<std::size_t>(c.dimensions()),
                   is_column ? static_cast<Eigen::Index>(c.row) : -1);
  }
  return columns;
}

Status Fitter::differentiate(Fit* fit, Eigen::Index known) const {
  const Eigen::Index dimensions = space_.dimensions();
  if (fit->differences.size() != dimensions) {
    const Eigen::Index had = std::min(fit->differences.size(), dimensions);
    fit->differences.conservativeResize(dimensions);
    fit->differences.tail(dimensions - had).setConstant(kFirstDifference);
  }
  std::vector<PredictionRequest> requests;
  std::vector<double> moved;
  std::vector<Eigen::Index> dimension;  // of each request
  const std::vector<Eigen::Index> column = columns_of_dimensions();
  for (Eigen::Index k = known; k < dimensions; ++k) {
    if (column[static_cast<std::size_t>(k)] >= 0) continue;
    dimension.push_back(k);
    Eigen::VectorXd u = fit->u;
    double step = fit->differences[k];
    if (u[k] + step > space_.upper()[k]) step = -step;
    u[k] += step;
    requests.push_back({space_.values(u), {}});
    moved.push_back(step);
  }
  ASSIGN_OR_RETURN(const auto ends, forward_(requests));
  fit->slopes.conservativeResize(fit->z.size(), dimensions);
  fit->slopes.rightCols(dimensions - known).setZero();
  for (Eigen::Index k = known; k < dimensions; ++k) {
    const Eigen::Index c = column[static_cast<std::size_t>(k)];
    if (c >= 0) fit->slopes.col(k) = -observations_.columns.col(c);
  }
  const Eigen::VectorXd linear = beside(fit->u);
  for (std::size_t j = 0; j < requests.size(); ++j) {
    const Eigen::Index k = dimension[j];
    if (!ends[j]) {
      fit->differences[k] /= 4;
      continue;
    }
    const Eigen::VectorXd change = whitened(*ends[j]) + linear - fit->z;
    fit->slopes.col(k) = change / moved[j];
    const double unit =
        std::sqrt(change.squaredNorm() / static_cast<double>(change.size())) / std::abs(moved[j]);
    const double good = kGoodMove * fit->scale / std::max(unit, 1e-9);
    fit->differences[k] = std::clamp(good, kLeastDifference, kMostDifference);
  }
  fit->fresh = true;
  return {};
}

Fitter::Normal Fitter::normal(const Fit& fit, std::optional<std::size_t> without_fold) const {
  const Eigen::Index dimensions = space_.dimensions();
  Normal normal{Eigen::MatrixXd::Zero(dimensions, dimensions), Eigen::VectorXd::Zero(dimensions)};
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    if (without_fold && observations_.fold[i] == *without_fold) continue;
    const auto at = static_cast<Eigen::Index>(i);
    const double w = weight(squares_of(fit.z, at), fit.scale);
    const auto rows = fit.slopes.middleRows<3>(3 * at);
    normal.matrix += w * rows.transpose() * rows;
    normal.right -= w * rows.transpose() * fit.z.segment<3>(3 * at);
  }
  normal.matrix.diagonal() += space_.prior();
  normal.right -= space_.prior().cwiseProduct(fit.u);
  // What the data do not see stays where it is.
  normal.matrix.diagonal().array() += 1e-9 * (1 + normal.matrix.diagonal().maxCoeff());
  return normal;
}

Eigen::VectorXd Fitter::bounded_step(const Eigen::VectorXd& u, const Normal& equations) const {
  return bounded_minimum(equations.matrix, equations.right,
                         (space_.lower() - u).cwiseMax(-kLongestStep).cwiseMin(0.0),
                         (space_.upper() - u).cwiseMin(kLongestStep).cwiseMax(0.0));
}

double Fitter::promise(const Fit& fit) const {
  const Normal equations = normal(fit, std::nullopt);
  return equations.gain(bounded_step(fit.u, equations));
}

Status Fitter::step(Fit* fit) const {
  if (fit->slopes.size() == 0) {
    if (Status s = differentiate(fit); !s) return s;
  }
  const Normal equations = normal(*fit, std::nullopt);
  for (int half = 0; half <= kMostHalvings; ++half) {
    Normal damped = equations;
    damped.matrix.diagonal() *= 1 + fit->damping;
    const Eigen::VectorXd delta = bounded_step(fit->u, damped);
    const double promised = equations.gain(delta);
    if (promised < kSettledGain / 5) {
      fit->settled = fit->fresh;
      break;
    }
    ASSIGN_OR_RETURN(auto next, start(fit->u + delta));
    const double gained = next.score - fit->score;
    if (gained > 0) {
      const double trust = gained / promised;
      next.damping = trust > kLeastTrust ? fit->damping / 10 : fit->damping;
      next.differences = fit->differences;
      // Broyden's correction: slopes of before that give what this step did.
      next.slopes = fit->slopes + (next.z - fit->z - fit->slopes * delta) * delta.transpose() /
                                      delta.squaredNorm();
      next.settled = gained < kSettledGain && fit->fresh;
      const bool lied = trust < kLeastTrust || trust > kMostTrust;
      if (lied || gained < kSettledGain) next.slopes.resize(0, 0);
      *fit = std::move(next);
      return {};
    }
    fit->damping = std::max(kLeastDamping, fit->damping) * (half == 0 ? 30 : 10);
  }
  if (fit->fresh) {
    fit->settled = true;
    return {};
  }
  // Slopes of before lead nowhere: those of this point may.
  fit->damping = 0;
  return differentiate(fit);
}

Status Fitter::improve(Fit* fit, int steps) const {
  if (!std::isfinite(fit->score)) return {};
  for (int k = 0; k < steps && !fit->settled; ++k) {
    if (Status s = step(fit); !s) return s;
  }
  return {};
}

std::vector<double> Fitter::held_out(const Fit& fit) const {
  std::vector<double> scores(observations_.size(), 0.0);
  const std::size_t folds = 1 + *std::ranges::max_element(observations_.fold);
  for (std::size_t f = 0; f < folds; ++f) {
    const Eigen::VectorXd z = fit.z + fit.slopes * bounded_step(fit.u, normal(fit, f));
    std::vector<Eigen::Index> in_sample;
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      if (observations_.fold[i] != f) in_sample.push_back(static_cast<Eigen::Index>(i));
    }
    const Eigen::VectorXd seen = z.reshaped(3, z.size() / 3)(Eigen::all, in_sample).reshaped();
    const double scale = best_scale(seen, observations_.least_scale, observations_.most_scale);
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      if (observations_.fold[i] != f) continue;
      scores[i] = score_of(squares_of(z, static_cast<Eigen::Index>(i)), scale);
    }
  }
  return scores;
}

}  // namespace gapfarm::infer
