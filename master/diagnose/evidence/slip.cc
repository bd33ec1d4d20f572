#include "master/diagnose/evidence/slip.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <nlopt.hpp>

#include "common/score/density.h"

namespace gapfarm {
namespace {

constexpr int kNodes = 6;             // midpoints of equal shares of (0, loss)
constexpr double kWorthFitting = 4;   // nats; noise alone gains about one a parameter
constexpr double kLeastDrive = 1e-4;  // its logarithm is searched

struct Event {
  double weight;
  double left, right;  // change of each side's gain
};

std::vector<Event> events_of(double probability, double loss) {
  const double p = probability, q = 1 - probability;
  std::vector<Event> all = {{q * q, 0, 0}};
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

class Mixture {
 public:
  Mixture(std::span<const ResidualTrial> trials, std::span<const Eigen::Vector3d> residuals,
          const std::vector<bool>& mask, const NoiseEstimate& noise)
      : trials_(trials), residuals_(residuals), mask_(mask), noise_(noise) {}

  double log_likelihood(double common, double side, double probability, double loss) const {
    NoiseEstimate noise = noise_;
    noise.drive_common = common;
    noise.drive_side = side;
    const std::vector<Event> events =
        probability > 0 ? events_of(probability, loss) : std::vector<Event>{{1, 0, 0}};
    std::vector<double> exponents(events.size());
    double sum = 0;
    for (std::size_t i = 0; i < trials_.size(); ++i) {
      if (!mask_[i]) continue;
      const ResidualTrial& t = trials_[i];
      const Eigen::LLT<Eigen::Matrix3d> factor(trial_covariance(t, noise));
      // The mean loss was taken out with the rest by the fit.
      const Eigen::Vector3d centred = residuals_[i] - probability * loss / 2 * (t.left + t.right);
      const auto lower = factor.matrixL();
      const Eigen::Vector3d r = lower.solve(centred);
      const Eigen::Vector3d left = lower.solve(t.left), right = lower.solve(t.right);
      for (std::size_t k = 0; k < events.size(); ++k) {
        exponents[k] = -0.5 * (r - events[k].left * left - events[k].right * right).squaredNorm();
      }
      // Far trials underflow in every event: measured from the nearest one.
      const double greatest = *std::max_element(exponents.begin(), exponents.end());
      double density = 0;
      for (std::size_t k = 0; k < events.size(); ++k) {
        density += events[k].weight * std::exp(exponents[k] - greatest);
      }
      sum += greatest + std::log(density) - factor.matrixLLT().diagonal().array().log().sum();
    }
    return sum;
  }

 private:
  std::span<const ResidualTrial> trials_;
  std::span<const Eigen::Vector3d> residuals_;
  const std::vector<bool>& mask_;
  NoiseEstimate noise_;
};

double maximise(const std::function<double(const std::vector<double>&)>& f, int most,
                std::vector<double>* x) {
  nlopt::opt search(nlopt::LN_NELDERMEAD, static_cast<unsigned>(x->size()));
  auto function = f;
  search.set_max_objective(
      [](unsigned n, const double* at, double*, void* self) {
        return (*static_cast<decltype(function)*>(self))(std::vector<double>(at, at + n));
      },
      &function);
  search.set_initial_step(0.2);
  search.set_xtol_abs(0.02);
  search.set_ftol_abs(0.1);
  search.set_maxeval(most);
  double value = f(*x);
  try {
    search.optimize(*x, value);
  } catch (const std::exception&) {
    value = f(*x);  // roundoff where nothing is left to gain
  }
  return value;
}

}  // namespace

SlipFit fit_slip(std::span<const ResidualTrial> trials, std::span<const Eigen::Vector3d> residuals,
                 const std::vector<bool>& mask, const NoiseEstimate& start) {
  NoiseEstimate noise = start;
  noise.drive_common = std::max(noise.drive_common, kLeastDrive);
  noise.drive_side = std::max(noise.drive_side, kLeastDrive);
  const Mixture mixture(trials, residuals, mask, noise);
  std::vector<double> plain = {std::log(noise.drive_common), std::log(noise.drive_side)};
  const double base = maximise(
      [&](const std::vector<double>& q) {
        return mixture.log_likelihood(std::exp(q[0]), std::exp(q[1]), 0, 0);
      },
      40, &plain);
  SlipFit fit;
  fit.noise = noise;
  for (double probability : {0.04, 0.1, 0.2, 0.4}) {
    for (double loss : {0.06, 0.12, 0.25, 0.5}) {
      for (double less : {1.0, 0.85}) {
        const double gain = mixture.log_likelihood(less * noise.drive_common,
                                                   less * noise.drive_side, probability, loss) -
                            base;
        if (gain > fit.gain) fit = {gain, probability, loss, noise};
      }
    }
  }
  if (fit.gain < kWorthFitting) return fit;
  std::vector<double> x = {plain[0], plain[1], std::log(fit.probability / (1 - fit.probability)),
                           std::log(fit.loss)};
  const auto probability = [](const std::vector<double>& q) {
    return std::min(0.5, 1 / (1 + std::exp(-q[2])));
  };
  const double best = maximise(
      [&](const std::vector<double>& q) {
        return mixture.log_likelihood(std::exp(q[0]), std::exp(q[1]), probability(q),
                                      std::min(1.0, std::exp(q[3])));
      },
      120, &x);
  fit.gain = std::max(fit.gain, best - base);
  fit.probability = probability(x);
  fit.loss = std::min(1.0, std::exp(x[3]));
  fit.noise.drive_common = std::exp(x[0]);
  fit.noise.drive_side = std::exp(x[1]);
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
      judged.push_back({-1e3, 0, 0, 0});
      continue;
    }
    const Eigen::Vector3d centred = residuals[i] - mean_loss * (t.left + t.right);
    std::vector<double> logs;
    const double squared = cov->squared_distance(centred);
    double nearest = squared;
    for (const Event& e : events) {
      const Eigen::Vector3d r = centred - e.left * t.left - e.right * t.right;
      nearest = std::min(nearest, cov->squared_distance(r));
      logs.push_back(std::log(e.weight) + log_predictive_density(r, *cov, outlier_share));
    }
    const double score = log_sum_exp(logs);
    judged.push_back({score, 1 - std::exp(logs.front() - score), squared, nearest});
  }
  return judged;
}

double residual_kurtosis(const Eigen::VectorXd& whitened) {
  const double second = whitened.size() > 0 ? whitened.array().square().mean() : 0;
  if (second <= 0) return 3;
  return whitened.array().pow(4).mean() / (second * second);
}

}  // namespace gapfarm
