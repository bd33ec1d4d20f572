#include "master/diagnose/evidence/drive_noise.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <vector>

namespace gapfarm {
namespace {

constexpr double kMost = 0.5;
constexpr double kTailFromSquared = 14;  // chi-square with 3 degrees of freedom: one in 340

struct Likelihood {
  std::span<const ResidualTrial> trials;
  std::span<const Eigen::Vector3d> residuals;
  NoiseEstimate start;
  bool fit_pose;
  CovarianceOf covariance;
  double tail;

  NoiseEstimate at(const std::vector<double>& log_values) const {
    NoiseEstimate noise = start;
    noise.drive_common = std::exp(log_values[0]);
    noise.drive_side = std::exp(log_values[1]);
    if (fit_pose) noise.pose = {std::exp(log_values[2]), std::exp(log_values[3])};
    return noise;
  }

  double negative(const NoiseEstimate& noise) const {
    double sum = 0;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      const Eigen::Matrix3d cov = covariance(trials[i], noise);
      const double d2 = residuals[i].dot(cov.inverse() * residuals[i]);
      const double bounded =
          d2 > kTailFromSquared
              ? kTailFromSquared + tail * std::log1p((d2 - kTailFromSquared) / tail)
              : d2;
      sum += 0.5 * (std::log(cov.determinant()) + bounded);
    }
    return sum;
  }
};

}  // namespace

NoiseEstimate refit_drive_noise(std::span<const ResidualTrial> trials,
                                std::span<const Eigen::Vector3d> residuals,
                                const NoiseEstimate& start, bool fit_pose, CovarianceOf covariance,
                                double tail) {
  const Likelihood likelihood{trials, residuals, start, fit_pose, covariance, tail};
  // An unknown value (0) begins at that of a small tracked robot under a good camera.
  const auto first = [](double value, double unknown) {
    return std::log(std::clamp(value > 0 ? value : unknown, kLeastDeviation, kMost));
  };
  std::vector<double> x = {first(start.drive_common, 0.01), first(start.drive_side, 0.01)};
  if (fit_pose) {
    x.push_back(first(start.pose.position_m, 0.0015));
    x.push_back(first(start.pose.heading_rad, 0.008));
  }
  nlopt::opt search(nlopt::LN_NELDERMEAD, static_cast<unsigned>(x.size()));
  search.set_min_objective(
      [](unsigned n, const double* at, double*, void* self) {
        const auto* l = static_cast<const Likelihood*>(self);
        return l->negative(l->at(std::vector<double>(at, at + n)));
      },
      const_cast<Likelihood*>(&likelihood));
  search.set_lower_bounds(std::vector<double>(x.size(), std::log(kLeastDeviation)));
  search.set_upper_bounds(std::vector<double>(x.size(), std::log(kMost)));
  search.set_initial_step(0.3);
  search.set_xtol_abs(0.005);
  search.set_maxeval(300);
  double value = 0;
  try {
    search.optimize(x, value);
  } catch (const std::exception&) {
    // Roundoff stops the search where nothing is left to gain; x holds the best point so far.
  }
  return likelihood.at(x);
}

}  // namespace gapfarm
