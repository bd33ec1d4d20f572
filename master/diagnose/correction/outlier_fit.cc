#include "master/diagnose/correction/outlier_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/score/density.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/subject.h"
#include "master/infer/climb.h"

namespace gapfarm {
namespace {

constexpr double kMostOutlierDeviation = 0.5;
constexpr double kNoOutlierDensity = -1e3;
constexpr int kMostEvaluations = 350;
constexpr int kMostToMove = 120;  // from where all trials led

// What a search moves: logarithms of the noise, then the outliers' values.
struct Search {
  std::vector<double> x;
  infer::Climb how = {.subplex = true, .x_tolerance = 0.003, .tolerance = 0.05};

  void add(double first, double lo, double hi, double by) {
    x.push_back(std::clamp(first, lo, hi));
    how.add(lo, hi, by);
  }
};

struct Range {
  double least, most;
};

double half_of(const OutlierDrives& s) { return (s.most - s.least) / 2; }
double middle_of(const OutlierDrives& s) { return (s.most + s.least) / 2; }

// In the order of the kinds.
struct Reach {
  Range half, middle;
};
constexpr Reach kReaches[] = {{{0.01, 0.45}, {-0.5, 0.5}},
                              {{0.002, 0.5}, {0, 1}},
                              {{0.02, 3}, {0, 0}},
                              {{5e-4, 0.3}, {1e-3, 1}}};

Search search_from(const NoiseEstimate& noise, const OutlierDrives* outliers) {
  Search search;
  for (const double deviation :
       {noise.drive_common, noise.drive_side, noise.pose.position_m, noise.pose.heading_rad}) {
    search.add(std::log(std::max(deviation, kLeastDeviation)), std::log(kLeastDeviation),
               std::log(kMostOutlierDeviation), 0.2);
  }
  if (outliers == nullptr) return search;
  const auto [half, middle] = kReaches[static_cast<std::size_t>(outliers->kind)];
  search.add(std::log(outliers->share / (1 - outliers->share)), -6, 1, 0.5);
  search.add(std::log(std::max(half_of(*outliers), half.least)), std::log(half.least),
             std::log(half.most), 0.4);
  if (outliers->kind == OutlierKind::kTurned) return search;
  if (outliers->kind == OutlierKind::kShifted) {
    search.add(std::log(middle_of(*outliers)), std::log(middle.least), std::log(middle.most), 0.3);
    search.add(outliers->direction_rad, -7, 7, 0.2);
    return search;
  }
  search.add(middle_of(*outliers), middle.least, middle.most,
             outliers->kind == OutlierKind::kSide ? 0.05 : 0.03);
  search.add(outliers->rest, -0.2, 0.2, 0.02);
  return search;
}

NoiseEstimate noise_at(const double* x) {
  return {{std::exp(x[2]), std::exp(x[3])}, std::exp(x[0]), std::exp(x[1])};
}

OutlierDrives contaminates_at(const OutlierDrives& like, const double* x) {
  OutlierDrives outliers = like;
  outliers.share = 1 / (1 + std::exp(-x[4]));
  double half = std::exp(x[5]), middle = 0;
  if (outliers.kind == OutlierKind::kShifted) {
    middle = std::exp(x[6]);
    half = std::min(half, middle);  // the other way is the other half's
    outliers.direction_rad = std::remainder(x[7], 2 * std::numbers::pi);
  } else if (outliers.kind != OutlierKind::kTurned) {
    middle = x[6];
    outliers.rest = x[7];
  }
  outliers.least = middle - half;
  outliers.most = middle + half;
  return outliers;
}

// Log densities of the ways in which a trial may end, weights included, the first that of a drive
// that is no outlier; none where there is no density.
std::vector<double> ways_of(const OutlierData& data, std::size_t i, const Eigen::Vector3d& residual,
                            const NoiseEstimate& noise, const OutlierDrives* outliers) {
  const Eigen::Matrix3d core = data.study.subject->covariance(data.study.trials[i], noise);
  const auto whole = Covariance3::factorise(core);
  if (!whole) return {};
  if (outliers == nullptr) return {log_predictive_density(residual, *whole, data.outlier_share)};
  const Pose measured = data.ends[i] * Pose{residual[0], residual[1], residual[2]};
  std::vector<double> logs;
  for (const OutlierMode& mode : outlier_modes(*outliers, data.facts[i], data.ends[i])) {
    const Eigen::Vector3d left = local_difference(mode.X_WE, measured);
    const auto wider = mode.spread.isZero(0)
                           ? whole
                           : Covariance3::factorise(core + mode.spread * mode.spread.transpose());
    if (!wider) return {};
    logs.push_back(std::log(mode.weight) +
                   log_predictive_density(left, *wider, data.outlier_share));
  }
  return logs;
}

double score_of(const OutlierData& data, std::size_t i, const Eigen::Vector3d& residual,
                const NoiseEstimate& noise, const OutlierDrives* outliers) {
  const std::vector<double> logs = ways_of(data, i, residual, noise, outliers);
  return logs.empty() ? kNoOutlierDensity : log_sum_exp(logs);
}

struct Likelihood {
  const OutlierData& data;
  const Residuals& residuals;
  const std::vector<bool>& learn;
  const OutlierDrives* like = nullptr;  // no outliers: null

  double nats(const NoiseEstimate& noise, const OutlierDrives* outliers) const {
    double sum = 0;
    for (std::size_t i = 0; i < data.size(); ++i) {
      if (learn[i]) sum += score_of(data, i, residuals[i], noise, outliers);
    }
    return sum;
  }
  double at(const double* x) const {
    if (like == nullptr) return nats(noise_at(x), nullptr);
    const OutlierDrives outliers = contaminates_at(*like, x);
    return nats(noise_at(x), &outliers);
  }
};

// The nearest hill's top.
double climb(const Likelihood& likelihood, int most, Search* from) {
  from->how.evaluations = most;
  return infer::climb([&](const std::vector<double>& x) { return likelihood.at(x.data()); },
                      from->how, &from->x);
}

OutlierFit climbed(const Likelihood& likelihood, int most, const OutlierFit& from) {
  OutlierFit fit = from;
  Search search = search_from(from.noise, &from.outliers);
  fit.nats = climb(likelihood, most, &search);
  fit.noise = noise_at(search.x.data());
  fit.outliers = contaminates_at(from.outliers, search.x.data());
  return fit;
}

// Where searches of a kind begin.
std::vector<OutlierDrives> first_outliers(OutlierKind kind) {
  std::vector<OutlierDrives> all;
  const auto add = [&](double least, double most, double direction_rad) {
    for (const double share : {0.03, 0.1, 0.3}) {
      all.push_back({kind, share, least, most, 0, direction_rad, 0, 0});
    }
  };
  switch (kind) {
    case OutlierKind::kSide:
      for (const double loss : {0.1, 0.25, 0.5}) add(-loss, 0, 0);
      for (const double gain : {0.1, 0.3}) add(0, gain, 0);
      break;
    case OutlierKind::kLate:
      for (const double age_s : {0.05, 0.1, 0.2, 0.4}) add(0.9 * age_s, 1.1 * age_s, 0);
      break;
    case OutlierKind::kTurned:
      for (const double most : {0.1, 0.3, 1.0, 2.5}) add(-most, most, 0);
      break;
    case OutlierKind::kShifted:
      for (const double by_m : {0.015, 0.03, 0.06, 0.12}) {
        for (int k = 0; k < 6; ++k) add(0.7 * by_m, 1.3 * by_m, k * std::numbers::pi / 6);
      }
      break;
  }
  return all;
}

// A side's speed at full duty and the sides' distance by least squares from what a gain of either
// side does to the ends.
void measure_robot(const OutlierData& data, OutlierDrives* outliers) {
  constexpr double kStep = 1e-4;
  const Eigen::DiagonalMatrix<double, 3> alike(1, 1, kHeadingLength_m);
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  Eigen::Vector2d product = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < data.size(); ++i) {
    const LoggedMotion& facts = data.facts[i];
    const Twist mode = log(between(facts.X_WS, data.ends[i]));
    const auto change = [&](const Twist& by) -> Eigen::Vector3d {
      return alike * (local_difference(exp(mode), exp(Twist(mode + kStep * by))) / kStep);
    };
    const Eigen::Vector3d ahead = change({0.5, 0, 0}), turn = change({0, 0, 1});
    for (const bool left : {true, false}) {
      const double driven = (left ? facts.left : facts.right) * facts.duration_s;
      Eigen::Matrix<double, 3, 2> columns;
      columns << driven * ahead, (left ? -driven : driven) * turn;
      squares += columns.transpose() * columns;
      const ResidualTrial& trial = data.study.trials[i];
      product += columns.transpose() * (alike * (left ? trial.left : trial.right));
    }
  }
  const Eigen::Vector2d speeds = squares.ldlt().solve(product);
  const auto within = [](double value) { return std::min(100.0, std::max(1e-3, value)); };
  outliers->speed_m_s = within(speeds[0]);
  outliers->gauge_m = within(outliers->speed_m_s / within(speeds[1]));
}

}  // namespace

double outlier_score(const OutlierData& data, std::size_t trial, const Eigen::Vector3d& residual,
                     const OutlierFit& fit) {
  return score_of(data, trial, residual, fit.noise, &fit.outliers);
}

double outlier_chance(const OutlierData& data, std::size_t trial, const Eigen::Vector3d& residual,
                      const OutlierFit& fit) {
  const std::vector<double> logs = ways_of(data, trial, residual, fit.noise, &fit.outliers);
  return logs.size() < 2 ? 0 : std::clamp(1 - std::exp(logs.front() - log_sum_exp(logs)), 0.0, 1.0);
}

OutlierFit refit_outliers(const OutlierData& data, const Residuals& residuals,
                          const std::vector<bool>& learn, const OutlierFit& from) {
  return climbed({data, residuals, learn, &from.outliers}, kMostToMove, from);
}

std::optional<OutlierFit> fit_outliers(const OutlierData& data, const Residuals& residuals,
                                       const std::vector<bool>& learn, const NoiseEstimate& start,
                                       double least_gain) {
  const Likelihood plain{data, residuals, learn};
  Search search = search_from(start, nullptr);
  const double without = climb(plain, kMostEvaluations, &search);
  const NoiseEstimate wide = noise_at(search.x.data());
  // Outliers have widened one of these.
  std::vector<NoiseEstimate> noises = {wide, wide, wide};
  noises[1].drive_common /= 4;
  noises[2].drive_common /= 2;
  noises[2].drive_side /= 2;
  OutlierDrives robot;
  measure_robot(data, &robot);
  std::optional<OutlierFit> best;
  for (std::size_t kind = 0; kind < outlier_kind_names().size(); ++kind) {
    OutlierFit first;
    first.nats = kNoOutlierDensity * static_cast<double>(data.size());
    for (OutlierDrives outliers : first_outliers(static_cast<OutlierKind>(kind))) {
      if (outliers.kind == OutlierKind::kSide) {
        outliers.speed_m_s = robot.speed_m_s;
        outliers.gauge_m = robot.gauge_m;
      }
      for (const NoiseEstimate& noise : noises) {
        const double nats = plain.nats(noise, &outliers);
        if (nats > first.nats) first = {outliers, noise, nats};
      }
    }
    OutlierFit fit = climbed({data, residuals, learn, &first.outliers}, kMostEvaluations, first);
    if (!best || fit.nats > best->nats) best = fit;
  }
  // The noise has more than one hill: what turns a robot may be a side's drive or a reading.
  Search other = search_from(best->noise, nullptr);
  const double gain = best->nats - std::max(without, climb(plain, kMostEvaluations, &other));
  return gain < least_gain ? std::nullopt : best;
}

}  // namespace gapfarm
