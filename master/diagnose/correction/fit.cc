#include "master/diagnose/correction/fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "master/diagnose/correction/basis.h"
#include "master/infer/compete.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// Prior standard deviations of shifts, in units of the noise's.
const std::vector<double> kAmplitudes = {0.5, 2, 8, 32};

class FieldSearch {
 public:
  FieldSearch(const ResidualData& data, const Residuals& residuals, const std::vector<bool>& seen)
      : data_(data), seen_(seen), left_(residuals) {
    learn_ = seen;
    for (std::size_t i = 0; i < data.size(); ++i) learn_[i] = seen[i] && data.learn[i];
    for (std::size_t f = 0; f < data.folds(); ++f) {
      std::vector<bool> others = learn_, own = seen;
      for (std::size_t i = 0; i < data.size(); ++i) {
        (data.fold[i] == f ? others : own)[i] = false;
      }
      if (contains(own, true)) folds_.push_back({std::move(others), std::move(own), residuals});
    }
  }

  ResidualField run() {
    ResidualField field;
    while (folds_.size() > 1 && field.size() < kMostFittedTerms) {
      set_bases();
      const auto best = best_next();
      if (!best) break;
      const auto [basis, amplitude] = *best;
      field.push_back(bases_[basis].fit(left_, learn_, amplitude));
      take(bases_[basis].shifts_of(field.back()), &left_);
      for (Fold& fold : folds_) {
        take(bases_[basis].shifts(fold.left, fold.learn, {amplitude}, seen_).front(), &fold.left);
      }
    }
    return field;
  }

 private:
  struct Fold {
    std::vector<bool> learn, own;
    Residuals left;  // after the terms so far, fitted without it
  };

  void set_bases() {
    bases_.clear();
    for (const ResidualShape& shape : residual_shapes(data_.free_commands)) {
      for (const std::vector<double>& lengths : shape.lengths) {
        ResidualBasis basis(data_, left_, learn_, shape, lengths);
        if (basis.useful()) bases_.push_back(std::move(basis));
      }
    }
  }

  static void take(const Residuals& shifts, Residuals* left) {
    for (std::size_t i = 0; i < left->size(); ++i) (*left)[i] -= shifts[i];
  }

  // Basis and amplitude of the next term; nothing where none gains significantly.
  std::optional<std::pair<std::size_t, double>> best_next() const {
    std::optional<std::pair<std::size_t, double>> best;
    double most = 0;
    for (std::size_t b = 0; b < bases_.size(); ++b) {
      std::vector<std::vector<double>> gains(kAmplitudes.size());
      for (const Fold& fold : folds_) {
        const auto shifts = bases_[b].shifts(fold.left, fold.learn, kAmplitudes, fold.own);
        for (std::size_t i = 0; i < data_.size(); ++i) {
          if (!fold.own[i]) continue;
          const double before = outlier_nats(data_.whiteners[i] * fold.left[i]);
          for (std::size_t a = 0; a < kAmplitudes.size(); ++a) {
            const double after = outlier_nats(data_.whiteners[i] * (fold.left[i] - shifts[a][i]));
            gains[a].push_back(after - before);
          }
        }
      }
      for (std::size_t a = 0; a < kAmplitudes.size(); ++a) {
        const double gain = mean(gains[a]);
        if (gain <= most || !gains_significantly(gains[a])) continue;
        most = gain;
        best = {b, kAmplitudes[a]};
      }
    }
    return best;
  }

  const ResidualData& data_;
  const std::vector<bool>& seen_;
  Residuals left_;
  std::vector<bool> learn_;
  std::vector<ResidualBasis> bases_;
  std::vector<Fold> folds_;
};

constexpr double kOutlierShare = 0.02, kOutlierScale = 5;
constexpr double kFarthestMiss = 3;  // standard deviations beyond which a trial pulls no harder
constexpr int kMissRounds = 12;
constexpr std::size_t kLeastCrossings = 4;

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
  return sum_of(crossing, [&](const auto& drive) {
    const auto& [c, beyond] = drive;
    return outlier_nats(c->whitened - beyond * (c->axes * shift)) - outlier_nats(c->whitened);
  });
}

}  // namespace

bool gains_significantly(const std::vector<double>& gains) {
  const auto [sum, se] = infer::paired_gain(gains, std::vector<double>(gains.size(), 0));
  return sum > kNormal90 * se;
}

std::size_t ResidualData::folds() const {
  return fold.empty() ? 0 : 1 + *std::max_element(fold.begin(), fold.end());
}

ResidualField fit_field(const ResidualData& data, const Residuals& residuals,
                        const std::vector<bool>& seen) {
  return FieldSearch(data, residuals, seen).run();
}

ResidualFit fit_residual(const ResidualData& data, const Residuals& residuals,
                         const std::function<Residuals(std::size_t)>& without) {
  ResidualFit fit;
  fit.field = fit_field(data, residuals, std::vector<bool>(data.size(), true));
  fit.unseen.assign(data.size(), Eigen::Vector3d::Zero());
  if (fit.field.empty()) return fit;
  for (std::size_t f = 0; f < data.folds(); ++f) {
    std::vector<bool> seen(data.size(), true);
    for (std::size_t i = 0; i < data.size(); ++i) seen[i] = data.fold[i] != f;
    const ResidualField field = fit_field(data, without(f), seen);
    for (std::size_t i = 0; i < data.size(); ++i) {
      if (seen[i] || field.empty()) continue;
      fit.unseen[i] = residual_shift(field, data.facts[i], data.ends[i]);
    }
  }
  return fit;
}

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
  double most = kLeastSecondOfAKind;
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
