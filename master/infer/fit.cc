#include "master/infer/fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/math/statistics.h"
#include "master/infer/settings.h"

namespace gapfarm::infer {
namespace {

constexpr int kMostHalvings = 3;
constexpr double kFirstDifference = 0.2;  // of a coordinate
constexpr double kLeastDifference = 0.01, kMostDifference = 1.5;
constexpr double kShareOfSides = 0.3;  // of a difference, to either side
constexpr double kLeastDamping = 1e-3;
// Shares of a difference, in the order in which they are tried.
constexpr double kTries[] = {1, -1, 0.1, -0.1};

double weight(Loss loss, double squares, double scale) {
  if (loss == Loss::kStudent) return (kStudentTail + 3) / (kStudentTail * scale * scale + squares);
  const double far = std::min(1.0, kFarDeviations * kFarDeviations * scale * scale / squares);
  return (loss == Loss::kHuber ? std::sqrt(far) : far) / (scale * scale);
}

double score_of(Loss loss, double squares, double scale) {
  const double relative = squares / (scale * scale), far = kFarDeviations * kFarDeviations;
  const double constant = -3 * std::log(scale);
  if (loss == Loss::kStudent)
    return constant - (kStudentTail + 3) / 2 * std::log1p(relative / kStudentTail);
  const double beyond = std::max(1.0, relative / far);
  const double grown = loss == Loss::kHuber ? 2 * (std::sqrt(beyond) - 1) : std::log(beyond);
  return constant - 0.5 * (std::min(relative, far) + far * grown);
}

double squares_of(const Eigen::VectorXd& z, Eigen::Index i) {
  return z.segment<3>(3 * i).squaredNorm();
}

// Root mean square of a change of `seen` observations.  One that jumps, across the rim of a patch,
// say, moves no farther than one that is far beyond the others.
double bound_jumps(std::size_t seen, double scale, Eigen::VectorXd* change) {
  const double moved = std::sqrt(change->squaredNorm() / (3 * static_cast<double>(seen)));
  const double far = kFarDeviations * std::max(moved, scale);
  for (Eigen::Index i = 0; i < change->size(); i += 3) {
    const double by = change->segment<3>(i).norm();
    if (by > far) change->segment<3>(i) *= far / by;
  }
  return moved;
}

}  // namespace

double Fitter::robust_score(const Eigen::VectorXd& z, double scale) const {
  double sum = 0;
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    if (!learns_from(i, std::nullopt)) continue;
    const double squares = squares_of(z, static_cast<Eigen::Index>(i));
    sum += times(i) * score_of(observations_.loss, squares, scale);
  }
  return sum;
}

double Fitter::best_scale(const Eigen::VectorXd& z, std::optional<std::size_t> without_fold) const {
  const double least = observations_.least_scale, most = observations_.most_scale;
  std::vector<std::pair<double, double>> squares;  // and how often they count
  double all = 0, numbers = 0;
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    if (!learns_from(i, without_fold)) continue;
    squares.emplace_back(squares_of(z, static_cast<Eigen::Index>(i)), times(i));
    all += times(i) * squares.back().first;
    numbers += 3 * times(i);
  }
  if (squares.empty() || least == most) return std::clamp(1.0, least, most);
  // The likelihood's own fixed point, which rises with every round (expectation, maximisation).
  double scale = std::clamp(std::sqrt(all / numbers), least, most);
  for (int round = 0; round < 60; ++round) {
    double sum = 0;
    for (const auto& [s, times] : squares) {
      sum += times * weight(observations_.loss, s, scale) * s * scale * scale;
    }
    const double next = std::clamp(std::sqrt(sum / numbers), least, most);
    const bool same = std::abs(next - scale) < 1e-4 * scale;
    scale = next;
    if (same) break;
  }
  return scale;
}

Fitter::Fitter(const Forward& forward, const Observations& observations, Space space,
               const Forward* coarse, Sides sides)
    : forward_(forward),
      observations_(observations),
      space_(std::move(space)),
      coarse_(coarse),
      sides_(sides) {}

Eigen::Vector3d Fitter::residual(std::size_t i, const Pose& end) const {
  return observations_.whitener[i] * (observations_.difference
                                          ? observations_.difference(i, end)
                                          : local_difference(end, observations_.measured[i]));
}

Eigen::VectorXd Fitter::whitened(const std::vector<Pose>& ends) const {
  Eigen::VectorXd z = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * observations_.size()));
  for (std::size_t j = 0; j < ends.size(); ++j) {
    const std::size_t i = observations_.asked.empty() ? j : observations_.asked[j];
    z.segment<3>(static_cast<Eigen::Index>(3 * i)) = residual(i, ends[j]);
  }
  return z;
}

Eigen::VectorXd Fitter::beside(const Eigen::VectorXd& u) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * observations_.size()));
  const std::vector<Eigen::Index> columns = columns_of_dimensions();
  for (Eigen::Index k = 0; k < u.size(); ++k) {
    const Eigen::Index c = columns[static_cast<std::size_t>(k)];
    if (c >= 0 && u[k] != 0) sum -= u[k] * observations_.columns.col(c);
  }
  return sum;
}

void Fitter::judge(Eigen::VectorXd z, Fit* fit, std::optional<std::size_t> without_fold) const {
  fit->z = std::move(z);
  fit->scale = best_scale(fit->z, without_fold);
  fit->score = robust_score(fit->z, fit->scale) - space_.price(fit->u, fit->u.size());
}

Fit Fitter::known(Eigen::VectorXd u, Eigen::VectorXd z) const {
  Fit fit;
  fit.u = std::move(u);
  judge(std::move(z), &fit);
  return fit;
}

Result<std::vector<Fit>> Fitter::starts(const std::vector<Eigen::VectorXd>& points,
                                        const std::vector<Space>& spaces,
                                        const std::vector<std::vector<std::uint32_t>>& reach,
                                        const Eigen::VectorXd& elsewhere) const {
  std::vector<PredictionRequest> requests;
  const auto reaches_all = [&](std::size_t k) { return reach.empty() || reach[k].empty(); };
  for (std::size_t k = 0; k < points.size(); ++k) {
    requests.push_back(
        {spaces[k].values(points[k]), reaches_all(k) ? observations_.asked : reach[k]});
  }
  ASSIGN_OR_RETURN(const auto ends, forward_(requests));
  std::vector<Fit> fits(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    fits[k].u = points[k];
    if (!ends[k]) continue;
    const std::vector<std::uint32_t>& some = requests[k].trials;
    const Eigen::VectorXd linear = beside(points[k]);
    Eigen::VectorXd z = reaches_all(k) ? whitened(*ends[k]) + linear : elsewhere;
    for (std::size_t j = 0; j < some.size() && !reaches_all(k); ++j) {
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

// Slopes of the `open` dimensions that can be moved by that share of their differences.
Status Fitter::move_each(const Forward& forward, const Eigen::VectorXd& from, double share,
                         std::vector<Eigen::Index>* open, Fit* fit) const {
  std::vector<PredictionRequest> requests;
  std::vector<Eigen::Index> dimension, closed;
  for (const Eigen::Index k : *open) {
    Eigen::VectorXd u = fit->u;
    u[k] += share * fit->differences[k];
    if (u[k] < space_.lower()[k] || u[k] > space_.upper()[k]) continue;
    requests.push_back({space_.values(u), observations_.asked});
    dimension.push_back(k);
  }
  if (requests.empty()) return {};
  ASSIGN_OR_RETURN(const auto ends, forward(requests));
  for (std::size_t j = 0; j < requests.size(); ++j) {
    if (!ends[j]) continue;
    const Eigen::Index k = dimension[j];
    const double step = share * fit->differences[k];
    Eigen::VectorXd change = whitened(*ends[j]) - from;
    const double moved = bound_jumps(ends[j]->size(), fit->scale, &change);
    fit->slopes.col(k) = change / step;
    const double good = kGoodMove * fit->scale / std::max(moved / std::abs(step), 1e-9);
    fit->differences[k] = std::clamp(good, kLeastDifference, kMostDifference);
    closed.push_back(k);
  }
  std::erase_if(*open, [&](Eigen::Index k) { return contains(closed, k); });
  return {};
}

// The same of those that can be moved both ways, by kShareOfSides of their differences.
Status Fitter::move_both_ways(const Forward& forward, std::vector<Eigen::Index>* open,
                              Fit* fit) const {
  const Eigen::VectorXd by = kShareOfSides * fit->differences;
  const auto has_room = [&](Eigen::Index k) {
    return fit->u[k] - by[k] >= space_.lower()[k] && fit->u[k] + by[k] <= space_.upper()[k];
  };
  std::vector<PredictionRequest> requests;
  for (const Eigen::Index k : *open) {
    if (!has_room(k)) continue;
    for (const double side : {-1.0, 1.0}) {
      const Eigen::VectorXd there = fit->u + side * by[k] * Eigen::VectorXd::Unit(by.size(), k);
      requests.push_back({space_.values(there), observations_.asked});
    }
  }
  ASSIGN_OR_RETURN(const auto ends, forward(requests));
  std::size_t next = 0;
  std::erase_if(*open, [&](Eigen::Index k) {
    if (!has_room(k)) return false;
    const auto &below = ends[next++], &above = ends[next++];
    if (!below || !above) return false;
    Eigen::VectorXd change = whitened(*above) - whitened(*below);
    bound_jumps(above->size(), 2 * kShareOfSides * fit->scale, &change);
    fit->slopes.col(k) = change / (2 * by[k]);
    return true;
  });
  return {};
}

Status Fitter::differentiate(Fit* fit, Eigen::Index known) const {
  const Eigen::Index dimensions = space_.dimensions();
  if (fit->differences.size() != dimensions) {
    const Eigen::Index had = std::min(fit->differences.size(), dimensions);
    fit->differences.conservativeResize(dimensions);
    fit->differences.tail(dimensions - had).setConstant(kFirstDifference);
  }
  fit->slopes.conservativeResize(fit->z.size(), dimensions);
  fit->slopes.rightCols(dimensions - known).setZero();
  const std::vector<Eigen::Index> column = columns_of_dimensions();
  std::vector<Eigen::Index> open;
  for (Eigen::Index k = known; k < dimensions; ++k) {
    const Eigen::Index c = column[static_cast<std::size_t>(k)];
    if (c >= 0) fit->slopes.col(k) = -observations_.columns.col(c);
    if (c < 0) open.push_back(k);
  }
  const Forward* forward = &forward_;
  Eigen::VectorXd from = fit->z - beside(fit->u);
  if (coarse_ != nullptr && !open.empty()) {
    ASSIGN_OR_RETURN(const auto there, (*coarse_)({{space_.values(fit->u), observations_.asked}}));
    if (there.front()) {
      forward = coarse_;
      from = whitened(*there.front());
    }
  }
  if (sides_ == Sides::kBoth) RETURN_IF_ERROR(move_both_ways(*forward, &open, fit));
  for (const double share : kTries) {
    RETURN_IF_ERROR(move_each(*forward, from, share, &open, fit));
  }
  for (const Eigen::Index k : open) fit->differences[k] /= 4;
  fit->fresh = true;
  return {};
}

Normal Fitter::normal(const Fit& fit, std::optional<std::size_t> without_fold) const {
  const Eigen::Index dimensions = space_.dimensions();
  Normal normal{Eigen::MatrixXd::Zero(dimensions, dimensions), Eigen::VectorXd::Zero(dimensions)};
  for (std::size_t i = 0; i < observations_.size(); ++i) {
    if (!learns_from(i, without_fold)) continue;
    const auto at = static_cast<Eigen::Index>(i);
    const double w = times(i) * weight(observations_.loss, squares_of(fit.z, at), fit.scale);
    const auto rows = fit.slopes.middleRows<3>(3 * at);
    normal.matrix += w * rows.transpose() * rows;
    normal.right -= w * rows.transpose() * fit.z.segment<3>(3 * at);
  }
  normal.matrix.diagonal() += space_.prior();
  normal.right += space_.pull(fit.u);
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
  const Normal equations = normal(fit);
  return equations.gain(bounded_step(fit.u, equations));
}

Status Fitter::step(Fit* fit) const {
  if (fit->slopes.size() == 0) {
    if (Status s = differentiate(fit); !s) return s;
  }
  const Normal equations = normal(*fit);
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
      next.damping = trust > 1 / kMostTrust ? fit->damping / 10 : fit->damping;
      next.differences = fit->differences;
      // Broyden's correction: slopes of before that give what this step did.
      next.slopes = fit->slopes + (next.z - fit->z - fit->slopes * delta) * delta.transpose() /
                                      delta.squaredNorm();
      next.settled = gained < kSettledGain && fit->fresh;
      const bool lied = trust < 1 / kMostTrust || trust > kMostTrust;
      if (!next.settled && (lied || gained < kSettledGain)) next.slopes.resize(0, 0);
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

Fit Fitter::linear_step(const Fit& fit, std::optional<std::size_t> without_fold) const {
  Fit next = fit;
  const Eigen::VectorXd delta = bounded_step(fit.u, normal(fit, without_fold));
  next.u += delta;
  judge(fit.z + fit.slopes * delta, &next, without_fold);
  return next;
}

std::vector<double> Fitter::scores(const Eigen::VectorXd& z) const {
  const double scale = best_scale(z, std::nullopt);
  std::vector<double> all;
  for (Eigen::Index i = 0; i < z.size() / 3; ++i) {
    all.push_back(score_of(observations_.loss, squares_of(z, i), scale));
  }
  return all;
}

std::vector<double> Fitter::held_out(const Fit& fit) const {
  std::vector<double> scores(observations_.size(), 0.0);
  const std::size_t folds = 1 + *std::ranges::max_element(observations_.fold);
  for (std::size_t f = 0; f < folds; ++f) {
    const Fit left = linear_step(fit, f);
    const auto factor = normal(fit, f).matrix.llt();
    for (std::size_t i = 0; i < observations_.size(); ++i) {
      if (observations_.fold[i] != f || !learns_from(i, std::nullopt)) continue;
      const auto at = static_cast<Eigen::Index>(3 * i);
      const Eigen::MatrixXd along =
          factor.matrixL().solve(fit.slopes.middleRows<3>(at).transpose());
      const Eigen::Matrix3d spread =
          Eigen::Matrix3d::Identity() + along.transpose() * along / (left.scale * left.scale);
      const Eigen::LLT<Eigen::Matrix3d> of_spread(spread);
      const Eigen::Vector3d z = of_spread.matrixL().solve(left.z.segment<3>(at));
      scores[i] = score_of(observations_.loss, z.squaredNorm(), left.scale) -
                  of_spread.matrixLLT().diagonal().array().log().sum();
    }
  }
  return scores;
}

}  // namespace gapfarm::infer
