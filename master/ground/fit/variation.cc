#include "master/ground/fit/variation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "common/math/algebra.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr int kVariationRounds = 60;
constexpr double kCovered = 0.9;  // of the windows that are held out
constexpr double kLeastError = 1e-12;

using Windows = std::vector<const EndedWindow*>;

struct Mixed {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
  std::map<std::size_t, Eigen::Vector3d> errors;  // variances, by length
};

Mixed begun_with(const Windows& windows, const Eigen::MatrixXd& covariance) {
  Mixed mixed{Eigen::VectorXd::Zero(covariance.rows()), covariance, {}};
  std::map<std::size_t, double> counts;
  for (const EndedWindow* w : windows) {
    auto [at, fresh] = mixed.errors.try_emplace(w->length, Eigen::Vector3d::Zero());
    at->second += w->residual.cwiseAbs2();
    counts[w->length] += 1;
  }
  for (auto& [length, squares] : mixed.errors) squares /= 2 * counts[length];
  return mixed;
}

Eigen::Matrix3d spread_of(const Mixed& mixed, const EndedWindow& w) {
  const Eigen::Vector3d errors = mixed.errors.at(w.length).cwiseMax(kLeastError);
  return w.slopes * mixed.covariance * w.slopes.transpose() + Eigen::Matrix3d(errors.asDiagonal());
}

Mixed fitted_to(const Windows& windows, const Eigen::MatrixXd& begin) {
  Mixed mixed = begun_with(windows, begin);
  for (int round = 0; round < kVariationRounds; ++round) {
    Mixed next{
        Eigen::VectorXd::Zero(begin.rows()), Eigen::MatrixXd::Zero(begin.rows(), begin.cols()), {}};
    std::map<std::size_t, double> counts;
    for (const EndedWindow* w : windows) {
      const Eigen::MatrixXd& J = w->slopes;
      const Eigen::MatrixXd DJ = mixed.covariance * J.transpose();
      const Eigen::MatrixXd K = DJ * inverse_of_symmetric(spread_of(mixed, *w));
      // Of this window's values, by how it ended: middle and covariance.
      const Eigen::VectorXd middle = mixed.mean - K * (w->residual + J * mixed.mean);
      const Eigen::MatrixXd C = mixed.covariance - K * DJ.transpose();
      next.mean += middle;
      next.covariance += middle * middle.transpose() + C;
      auto [at, fresh] = next.errors.try_emplace(w->length, Eigen::Vector3d::Zero());
      at->second += (w->residual + J * middle).cwiseAbs2() + (J * C * J.transpose()).diagonal();
      counts[w->length] += 1;
    }
    const auto count = static_cast<double>(windows.size());
    next.mean /= count;
    next.covariance = (next.covariance / count - next.mean * next.mean.transpose()).eval();
    for (auto& [length, squares] : next.errors) squares /= counts[length];
    mixed = std::move(next);
  }
  return mixed;
}

double log_likelihood(const Windows& windows, const Mixed& mixed) {
  double sum = 0;
  for (const EndedWindow* w : windows) {
    const Eigen::Matrix3d S = spread_of(mixed, *w);
    const Eigen::Vector3d off = w->residual + w->slopes * mixed.mean;
    sum -= 0.5 * (std::log(S.determinant()) + off.dot(solve_symmetric(S, off)));
  }
  return sum;
}

// Values vary where that is likelier by more than a nat for each than that they do not: windows
// that are a row each hardly distinguish it from errors of their ends.
Mixed likeliest(const Windows& windows, const Eigen::MatrixXd& begin) {
  Mixed varying = fitted_to(windows, begin);
  Mixed constant = fitted_to(windows, 0 * begin);
  const double gain = log_likelihood(windows, varying) - log_likelihood(windows, constant);
  return gain > static_cast<double>(begin.rows()) ? varying : constant;
}

// What variances are to be multiplied by so that runs that are held out in turn are covered.
double widening(const Windows& windows, const Eigen::MatrixXd& begin) {
  std::set<std::size_t> runs;
  for (const EndedWindow* w : windows) runs.insert(w->run);
  const std::size_t folds = std::min<std::size_t>(runs.size(), kFolds);
  if (folds < 2) return 1;
  std::vector<double> squares;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    Windows fitted, held_out;
    for (const EndedWindow* w : windows) {
      const auto order = static_cast<std::size_t>(std::distance(runs.begin(), runs.find(w->run)));
      (order % folds == fold ? held_out : fitted).push_back(w);
    }
    const Mixed mixed = likeliest(fitted, begin);
    for (const EndedWindow* w : held_out) {
      if (mixed.errors.count(w->length) == 0) continue;
      const Eigen::Vector3d off = w->residual + w->slopes * mixed.mean;
      squares.push_back(off.dot(solve_symmetric(spread_of(mixed, *w), off)));
    }
  }
  if (squares.empty()) return 1;
  return std::max(1.0, quantile(squares, kCovered) / chi_squared_quantile(3, kCovered));
}

}  // namespace

Variation variation_of(const std::vector<EndedWindow>& windows, const Eigen::MatrixXd& begin) {
  std::map<std::size_t, std::vector<double>> seconds;
  for (const EndedWindow& w : windows) seconds[w.length].push_back(w.seconds);
  std::erase_if(seconds, [](const auto& of) { return of.second.size() < kEnoughToScatter; });
  Windows used;
  for (const EndedWindow& w : windows) {
    if (seconds.count(w.length) > 0) used.push_back(&w);
  }
  Variation variation{
      Eigen::VectorXd::Zero(begin.rows()), Eigen::MatrixXd::Zero(begin.rows(), begin.cols()), {}};
  if (used.empty()) return variation;
  const Mixed mixed = likeliest(used, begin);
  const double wider = widening(used, begin);
  variation.shift = mixed.mean;
  variation.covariance = wider * mixed.covariance;
  for (const auto& [length, errors] : mixed.errors) {
    variation.scatter.push_back(
        {median(seconds[length]), (wider * errors.cwiseMax(0)).cwiseSqrt()});
  }
  return variation;
}

}  // namespace gapfarm
