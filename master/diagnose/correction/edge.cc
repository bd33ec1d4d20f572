#include "master/diagnose/correction/edge.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gapfarm {
namespace {

constexpr double kOutlierShare = 0.02, kOutlierScale = 5;
constexpr double kFarthestMiss = 3;  // standard deviations beyond which a trial pulls no harder
constexpr int kMissRounds = 12;
constexpr std::size_t kLeastCrossings = 4;
// Nats, of the best of a thousand places: noise alone reaches half of that.
constexpr double kLeastGain = 20;

// A drive's readings along the covariate, and what a shift of what lies beyond does to its end.
struct Crossing {
  double from = 0, to = 0;
  Eigen::Vector3d whitened;
  Eigen::Matrix<double, 3, 2> axes;
};

// Nats that one shift gains over the drives that cross.
double gain_at(const std::vector<Crossing>& drives, double edge) {
  std::vector<std::pair<const Crossing*, double>> crossing;
  Eigen::Matrix2d matrix = Eigen::Matrix2d::Zero();
  for (const Crossing& c : drives) {
    const double beyond = (c.to > edge ? 1.0 : 0.0) - (c.from > edge ? 1.0 : 0.0);
    if (beyond == 0) continue;
    crossing.emplace_back(&c, beyond);
    matrix += c.axes.transpose() * c.axes;
  }
  if (crossing.size() < kLeastCrossings) return 0;
  Eigen::Matrix2d inverse;
  inverse << matrix(1, 1), -matrix(0, 1), -matrix(1, 0), matrix(0, 0);
  inverse /= matrix(0, 0) * matrix(1, 1) - matrix(0, 1) * matrix(1, 0);
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  for (int round = 0; round < kMissRounds; ++round) {
    Eigen::Vector2d pull = Eigen::Vector2d::Zero();
    for (const auto& [c, beyond] : crossing) {
      Eigen::Vector3d left = c->whitened - beyond * (c->axes * shift);
      const double far = left.norm();
      if (round > 0 && far > kFarthestMiss) left *= kFarthestMiss / far;
      pull += beyond * (c->axes.transpose() * left);
    }
    shift += inverse * pull;
  }
  double gain = 0;
  for (const auto& [c, beyond] : crossing) {
    gain += outlier_nats(c->whitened - beyond * (c->axes * shift)) - outlier_nats(c->whitened);
  }
  return gain;
}

}  // namespace

double outlier_nats(const Eigen::Vector3d& whitened) {
  const double q = whitened.squaredNorm();
  const double wide = kOutlierShare / (kOutlierScale * kOutlierScale * kOutlierScale);
  return std::log((1 - kOutlierShare) * std::exp(-q / 2) +
                  wide * std::exp(-q / (2 * kOutlierScale * kOutlierScale)) + 1e-300);
}

std::optional<double> best_edge(const ResidualData& data, const Residuals& residuals,
                                const std::vector<bool>& seen, std::size_t covariate) {
  const ResidualCovariate& along = residual_covariates()[covariate];
  std::vector<Crossing> drives;
  std::vector<double> readings;
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (!seen[i]) continue;
    const LoggedMotion& facts = data.facts[i];
    const Eigen::Matrix3d axes =
        data.whiteners[i] * residual_axes(ResidualFrame::kReadings, facts.X_WS, data.ends[i]);
    drives.push_back({along.value(facts, facts.X_WS), along.value(facts, data.ends[i]),
                      data.whiteners[i] * residuals[i], axes.leftCols<2>()});
    readings.insert(readings.end(), {drives.back().from, drives.back().to});
  }
  std::sort(readings.begin(), readings.end());
  std::optional<double> best;
  double most = kLeastGain;
  for (std::size_t r = 0; r + 1 < readings.size(); ++r) {
    const double edge = (readings[r] + readings[r + 1]) / 2;
    const double gain = gain_at(drives, edge);
    if (gain <= most) continue;
    most = gain;
    best = edge;
  }
  return best;
}

}  // namespace gapfarm
