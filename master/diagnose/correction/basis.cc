#include "master/diagnose/correction/basis.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <optional>
#include <string_view>

#include "common/base/ranges.h"
#include "common/math/algebra.h"
#include "common/math/statistics.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr double kSpacing = 0.7;  // of centres, in lengths
constexpr double kJitter = 1e-6;
constexpr int kRounds = 4;       // that these are found in
constexpr double kApart = 2;     // bumps in a row, in lengths: their sum is even to 1.5 %
constexpr double kBeyond = 0.1;  // that a row goes on past the last reading, of all readings' range

// The point at which a covariate is looked at, in lengths; angles as points of a circle.
Eigen::VectorXd scaled_point(const ResidualTerm& term, const LoggedMotion& facts,
                             const Pose& X_WR) {
  const auto known = residual_covariates();
  Eigen::Matrix2Xd point(2, term.covariates.size());
  for (std::size_t j = 0; j < term.covariates.size(); ++j) {
    const ResidualCovariate& covariate = known[term.covariates[j]];
    const double value = covariate.value(facts, X_WR);
    point.col(j) = covariate.cyclic ? Eigen::Vector2d(std::cos(value), std::sin(value))
                                    : Eigen::Vector2d(value, 0);
    point.col(j) /= term.lengths[j];
  }
  return point.reshaped();
}

Eigen::Matrix3d noise_of(const Eigen::Matrix3d& whitener) {
  return inverse_of_symmetric(whitener.transpose() * whitener);
}

std::vector<std::size_t> rows_of_covariates(std::initializer_list<std::string_view> names) {
  const auto known = residual_covariates();
  return mapped(names, [&](std::string_view name) -> std::size_t {
    return std::ranges::find(known, name, &ResidualCovariate::name) - known.begin();
  });
}

using Lengths = std::vector<std::vector<double>>;

// One and the same for so many covariates.
Lengths alike(std::size_t count, std::initializer_list<double> lengths) {
  return mapped(lengths, [&](double length) { return std::vector<double>(count, length); });
}

}  // namespace

ResidualBasis::ResidualBasis(const ResidualData& data, const Residuals& residuals,
                             const std::vector<bool>& seen, const ResidualShape& shape,
                             const std::vector<double>& lengths)
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
    turned_.push_back(residual_axes(term_.frame, data.facts[i].X_WS, data.ends[i]));
    axes_.push_back(data.whiteners[i] * turned_.back());
  }
  set_units();
  const std::vector<Place> among = places(seen);
  place_lengths(among, lengths);
  if (shape.edge) {
    place_edge(among, residuals, seen);
  } else {
    place_centres(among);
  }
  if (useful_) set_features();
}

double ResidualBasis::value(std::size_t covariate, const Place& place) const {
  return residual_covariates()[covariate].value(data_.facts[place.trial], place.X_WR);
}

Interval ResidualBasis::range_of(std::size_t covariate, const std::vector<Place>& among) const {
  Interval range = {INFINITY, -INFINITY};
  for (const Place& place : among) {
    range.lower = std::min(range.lower, value(covariate, place));
    range.upper = std::max(range.upper, value(covariate, place));
  }
  return range;
}

std::vector<ResidualBasis::Place> ResidualBasis::places(const std::vector<bool>& seen) const {
  std::vector<Place> places;
  for (std::size_t i = 0; i < data_.size(); ++i) {
    if (!seen[i]) continue;
    places.push_back({i, data_.facts[i].X_WS});
    if (term_.frame == ResidualFrame::kReadings) places.push_back({i, data_.ends[i]});
  }
  return places;
}

void ResidualBasis::set_units() {
  const auto noises = mapped(data_.whiteners, noise_of);
  for (int k = 0; k < 3; ++k) {
    unit_[k] = median(mapped(noises, [&](const auto& noise) { return std::sqrt(noise(k, k)); }));
  }
  unit_[0] = unit_[1] = std::max(unit_[0], unit_[1]);
  if (term_.by_drive) unit_ /= std::max(1e-6, median(mapped(data_.facts, drive_s)));
  if (term_.frame == ResidualFrame::kMotion) {
    using M = const Eigen::Matrix3d&;
    const auto distances = mapped(turned_, [](M m) { return std::hypot(m(0, 0), m(1, 1)); });
    const auto turns = mapped(turned_, [](M m) { return std::abs(m(2, 2)); });
    unit_.head<2>() /= std::max(1e-3, median(distances));
    unit_[2] /= std::max(1e-2, quantile(turns, 0.75));
  }
}

void ResidualBasis::set_features() {
  for (std::size_t i = 0; i < data_.size(); ++i) {
    features_.push_back(residual_features(term_, data_.facts[i], data_.ends[i]));
    if (tied_) features_.back() = Eigen::VectorXd::Constant(1, features_.back().sum());
  }
}

void ResidualBasis::place_lengths(const std::vector<Place>& among,
                                  const std::vector<double>& shares) {
  const auto known = residual_covariates();
  for (const std::size_t row : term_.covariates) {
    const auto [least, most] = range_of(row, among);
    const bool flag = std::string_view(known[row].name).ends_with("_reversed") ||
                      std::string_view(known[row].name) == "moved";
    const double range = known[row].cyclic || flag ? 1 : most - least;
    // What does not vary does not matter.
    const double length = shares[term_.lengths.size()] * range;
    term_.lengths.push_back(range > 1e-6 ? std::round(length * 1e4) / 1e4 : 1);
  }
}

// Greedily the trial farthest from all centres so far, until every trial is near one.
void ResidualBasis::place_centres(const std::vector<Place>& among) {
  std::vector<Eigen::VectorXd> points = mapped(among, [&](const Place& place) {
    return scaled_point(term_, data_.facts[place.trial], place.X_WR);
  });
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
  useful_ = !centres.empty() && !(constant && term_.frame == ResidualFrame::kReadings);
  term_.centres.resize(centres.size(), term_.covariates.size());
  kernel_.resize(term_.centres.rows(), term_.centres.rows());
  for (std::size_t k = 0; k < centres.size(); ++k) {
    for (std::size_t j = 0; j < term_.covariates.size(); ++j) {
      const double at = value(term_.covariates[j], among[centres[k]]);
      term_.centres(k, j) = std::round(at * 1e4) / 1e4;
    }
    for (std::size_t l = 0; l < centres.size(); ++l) {
      const double d2 = (points[centres[k]] - points[centres[l]]).squaredNorm();
      kernel_(k, l) = std::exp(-0.5 * d2);
    }
  }
  kernel_.diagonal().array() += kJitter;
}

// Bumps in a row, as narrow as there may be centres for, over the readings on the closer side.
void ResidualBasis::place_edge(const std::vector<Place>& among, const Residuals& residuals,
                               const std::vector<bool>& seen) {
  const std::size_t row = term_.covariates.front();
  const std::optional<double> edge = best_edge(data_, residuals, seen, row);
  useful_ = edge.has_value();
  if (!edge) return;
  const auto [least, most] = range_of(row, among);
  const double beyond = kBeyond * (most - least);
  const bool up = most - *edge < *edge - least;
  const double reach = up ? most + beyond - *edge : *edge - least + beyond;
  const auto count = static_cast<Eigen::Index>(kMostResidualCentres);
  const double apart = reach / static_cast<double>(count);
  term_.lengths = {std::round(apart / kApart * 1e5) / 1e5};
  term_.centres.resize(count, 1);
  for (Eigen::Index k = 0; k < count; ++k) {
    // Half a space on, since the first one's slope is as long as the space between two.
    const double at = *edge + (up ? 1 : -1) * (static_cast<double>(k) + 0.5) * apart;
    term_.centres(k, 0) = std::round(at * 1e5) / 1e5;
  }
  tied_ = true;
  kernel_ = Eigen::MatrixXd::Identity(1, 1);
}

ResidualBasis::Lesson ResidualBasis::lesson_of(std::size_t group, const Residuals& residuals,
                                               const std::vector<bool>& learn) const {
  const Eigen::Index k = kernel_.rows(), parts = components();
  Lesson lesson{{}, {}, Eigen::MatrixXd::Zero(parts * k, parts * k), false};
  for (const std::size_t i : of_group_[group]) {
    if (!learn[i]) continue;
    lesson.trials.push_back(i);
    lesson.whitened.push_back(data_.whiteners[i] * residuals[i]);
    lesson.outliers |= lesson.whitened.back().norm() > kFarthestPull;
    const Eigen::Matrix3d inner = axes_[i].transpose() * axes_[i];
    const Eigen::MatrixXd outer = features_[i] * features_[i].transpose();
    for (Eigen::Index a = 0; a < parts; ++a) {
      for (Eigen::Index b = 0; b < parts; ++b) {
        if (inner(a, b) != 0) lesson.matrix.block(a * k, b * k, k, k) += inner(a, b) * outer;
      }
    }
  }
  return lesson;
}

// What pulls beyond these weights: a trial that lies far from them pulls no harder than from
// kFarthestPull.
Eigen::VectorXd ResidualBasis::pull_of(const Lesson& lesson, const Eigen::MatrixXd& weights) const {
  const Eigen::Index k = kernel_.rows(), parts = components();
  Eigen::VectorXd right = Eigen::VectorXd::Zero(parts * k);
  for (std::size_t l = 0; l < lesson.trials.size(); ++l) {
    const std::size_t i = lesson.trials[l];
    const Eigen::Vector3d predicted = axes_[i] * (weights.transpose() * features_[i]);
    Eigen::Vector3d left = lesson.whitened[l] - predicted;
    const double far = left.norm();
    if (far > kFarthestPull) left *= kFarthestPull / far;
    const Eigen::Vector3d pull = axes_[i].transpose() * (predicted + left);
    for (Eigen::Index a = 0; a < parts; ++a) right.segment(a * k, k) += pull[a] * features_[i];
  }
  return right;
}

Eigen::MatrixXd ResidualBasis::solve(const Lesson& lesson, double amplitude) const {
  const Eigen::Index k = kernel_.rows(), parts = components();
  Eigen::MatrixXd matrix = lesson.matrix;
  for (Eigen::Index a = 0; a < parts; ++a) {
    const double sd = amplitude * unit_[a];
    matrix.block(a * k, a * k, k, k) += kernel_ / (sd * sd);
  }
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(k, 3);
  for (int round = 0; round < (lesson.outliers ? kRounds : 1); ++round) {
    // Shifts are reported in um and urad; scaled alike, metres and radians are solved alike.
    const Eigen::VectorXd solved = solve_symmetric(matrix, pull_of(lesson, weights));
    for (Eigen::Index a = 0; a < parts; ++a) weights.col(a) = solved.segment(a * k, k);
  }
  return weights;
}

Eigen::Vector3d ResidualBasis::shift(std::size_t trial, const Eigen::MatrixXd& weights) const {
  return turned_[trial] * (weights.transpose() * features_[trial]);
}

ResidualTerm ResidualBasis::fit(const Residuals& residuals, const std::vector<bool>& learn,
                                double amplitude) const {
  ResidualTerm term = term_;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    Eigen::MatrixXd weights = solve(lesson_of(g, residuals, learn), amplitude);
    if (tied_) weights = weights.replicate(term_.centres.rows(), 1).eval();
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
    const Lesson lesson = lesson_of(g, residuals, learn);
    for (std::size_t a = 0; a < amplitudes.size(); ++a) {
      const Eigen::MatrixXd weights = solve(lesson, amplitudes[a]);
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
    const Eigen::MatrixXd& shifts = term.weights[g].shifts;
    for (const std::size_t i : of_group_[g]) all[i] = shift(i, tied_ ? shifts.topRows(1) : shifts);
  }
  return all;
}

std::vector<ResidualShape> residual_shapes(bool free_commands) {
  using F = ResidualFrame;
  using Names = std::initializer_list<std::string_view>;
  std::vector<ResidualShape> shapes;
  const auto add = [&](F frame, bool by_drive, Names names, Lengths lengths) {
    const bool own = frame == F::kRobot || frame == F::kWorld;
    std::vector<std::size_t> rows = rows_of_covariates(names);
    if (free_commands && own) {
      std::erase(rows, rows_of_covariates({"level"}).front());
      for (const std::size_t duty : rows_of_covariates({"left", "right"})) rows.push_back(duty);
      for (std::vector<double>& length : lengths) length.resize(rows.size(), length.back());
    }
    shapes.push_back(
        {frame, by_drive, own && !free_commands, false, std::move(rows), std::move(lengths)});
    return &shapes.back();
  };
  add(F::kRobot, true, {"duration", "level"}, alike(2, {0.35, 1}));
  add(F::kWorld, true, {"duration", "level"}, alike(2, {0.35, 1}));
  if (free_commands) {
    // What sets in at some speed: a threshold, a limit.
    for (const Names side : {Names{"left"}, Names{"right"}}) {
      shapes.push_back(
          {F::kRobot, false, false, false, rows_of_covariates(side), alike(1, {0.05, 0.15})});
    }
    add(F::kMotion, false, {"left", "right"}, alike(2, {0.35, 1}));
  }
  add(F::kRobot, true, {"heading"}, alike(1, {0.6, 1.2}));
  add(F::kRobot, true, {"x", "y"}, alike(2, {0.35, 1}));
  add(F::kRobot, true, {"time"}, alike(1, {0.35, 1}));
  add(F::kRobot, false, {"left_reversed", "right_reversed"}, alike(2, {0.5}));
  add(F::kRobot, true, {"moved"}, alike(1, {0.5}));
  add(F::kMotion, false, {"x", "y"}, alike(2, {0.35, 1}));
  add(F::kMotion, false, {"time"}, alike(1, {0.35, 1}));
  add(F::kReadings, false, {"x"}, alike(1, {0.1, 0.35, 1}));
  add(F::kReadings, false, {"y"}, alike(1, {0.1, 0.35, 1}));
  add(F::kReadings, false, {"x", "y"}, alike(2, {0.35, 1}));
  add(F::kReadings, false, {"heading"}, alike(1, {0.6, 1.2}));
  for (const Names axis : {Names{"x"}, Names{"y"}}) {
    add(F::kReadings, false, axis, alike(1, {0.003}))->edge = true;
  }
  return shapes;
}

}  // namespace gapfarm
