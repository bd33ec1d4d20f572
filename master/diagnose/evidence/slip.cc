#include "master/diagnose/evidence/slip.h"

#include <algorithm>
#include <cmath>

#include "common/score/density.h"
#include "master/infer/climb.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr int kNodes = 6;             // midpoints of equal shares of (0, loss)
constexpr double kLeastDrive = 1e-4;  // its logarithm is searched

struct Event {
  double weight;
  double left, right;  // change of each side's gain
};

std::vector<Event> events_of(double probability, double loss) {
  const double p = probability, q = 1 - probability;
  std::vector<Event> all = {{q * q, 0, 0}};
  if (p == 0) return all;
  for (int i = 0; i < kNodes; ++i) {
    const double u = -loss * (i + 0.5) / kNodes;
    all.push_back({p * q / kNodes, u, 0});
    all.push_back({p * q / kNodes, 0, u});
  }
  for (int i = 0; i < kNodes; i += 2) {
    for (int j = 0; j < kNodes; j += 2) {
      all.push_back({p * p / 9, -loss * (i + 1.0) / kNodes, -loss * (j + 1.0) / kNodes});
    }
  }
  return all;
}

}  // namespace

SlipFit fit_slip(std::span<const ResidualTrial> trials, std::span<const Eigen::Vector3d> residuals,
                 const std::vector<bool>& mask, const NoiseEstimate& start) {
  std::vector<ResidualTrial> seen;
  std::vector<Eigen::Vector3d> left;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (!mask[i]) continue;
    seen.push_back(trials[i]);
    left.push_back(residuals[i]);
  }
  // The mean loss was taken out with the rest by the fit.
  const auto nats = [&](const SlipFit& fit) {
    double sum = 0;
    for (const SlipTrial& t :
         trials_with_slips(seen, left, fit, fit.probability * fit.loss / 2, 0)) {
      sum += t.score;
    }
    return sum;
  };
  NoiseEstimate noise = start;
  noise.drive_common = std::max(noise.drive_common, kLeastDrive);
  noise.drive_side = std::max(noise.drive_side, kLeastDrive);
  // Logarithms of the drive's noise, then of the odds of a slip and of its greatest loss.
  const auto at = [&](const std::vector<double>& x) {
    SlipFit fit{0, 0, 0, noise};
    fit.noise.drive_common = std::exp(x[0]);
    fit.noise.drive_side = std::exp(x[1]);
    if (x.size() == 2) return fit;
    fit.probability = std::min(0.5, 1 / (1 + std::exp(-x[2])));
    fit.loss = std::min(1.0, std::exp(x[3]));
    return fit;
  };
  const auto maximise = [&](int most, std::vector<double>* x) {
    return infer::climb([&](const std::vector<double>& tried) { return nats(at(tried)); },
                        {.step = std::vector<double>(x->size(), 0.2),
                         .x_tolerance = 0.02,
                         .tolerance = 0.1,
                         .evaluations = most},
                        x);
  };
  std::vector<double> plain = {std::log(noise.drive_common), std::log(noise.drive_side)};
  const double base = maximise(40, &plain);
  SlipFit fit{0, 0, 0, noise};
  for (double probability : {0.04, 0.1, 0.2, 0.4}) {
    for (double loss : {0.06, 0.12, 0.25, 0.5}) {
      for (double less : {1.0, 0.85}) {
        SlipFit tried{0, probability, loss, noise};
        tried.noise.drive_common *= less;
        tried.noise.drive_side *= less;
        const double gain = nats(tried) - base;
        if (gain > fit.gain) fit = {gain, probability, loss, noise};
      }
    }
  }
  if (fit.gain < kLeastPromise) return fit;
  std::vector<double> x = {plain[0], plain[1], std::log(fit.probability / (1 - fit.probability)),
                           std::log(fit.loss)};
  const double gain = std::max(fit.gain, maximise(120, &x) - base);
  fit = at(x);
  fit.gain = gain;
  return fit;
}

std::vector<SlipTrial> trials_with_slips(std::span<const ResidualTrial> trials,
                                         std::span<const Eigen::Vector3d> residuals,
                                         const SlipFit& fit, double mean_loss,
                                         double outlier_share) {
  const std::vector<Event> events = events_of(fit.probability, fit.loss);
  std::vector<SlipTrial> judged;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const ResidualTrial& t = trials[i];
    const auto cov = Covariance3::factorise(trial_covariance(t, fit.noise));
    if (!cov) {
      judged.push_back({-1e3, 0, 0});
      continue;
    }
    const Eigen::Vector3d centred = residuals[i] - mean_loss * (t.left + t.right);
    std::vector<double> logs;
    const double squared = cov->squared_distance(centred);
    double nearest = squared;
    for (const Event& e : events) {
      const Eigen::Vector3d r = centred - e.left * t.left - e.right * t.right;
      const bool one_side = e.left == 0 || e.right == 0;  // both at once are rare
      if (one_side) nearest = std::min(nearest, cov->squared_distance(r));
      logs.push_back(std::log(e.weight) + log_predictive_density(r, *cov, outlier_share));
    }
    judged.push_back({log_sum_exp(logs), squared, nearest});
  }
  return judged;
}

double residual_kurtosis(const Eigen::VectorXd& whitened) {
  const double second = whitened.size() > 0 ? whitened.array().square().mean() : 0;
  if (second <= 0) return 3;
  return whitened.array().pow(4).mean() / (second * second);
}

}  // namespace gapfarm
