#include "master/diagnose/drive_noise.h"

#include <Eigen/Dense>
#include <cmath>
#include <nlopt.hpp>
#include <vector>

namespace gapfarm {
namespace {

constexpr double kFarSquared = 14;  // chi-square with 3 degrees of freedom: one in 340

struct Likelihood {
  std::span<const ResidualTrial> trials;
  std::span<const Eigen::Vector3d> residuals;
  NoiseEstimate start;
  bool fit_pose;

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
      const Eigen::Matrix3d cov = trial_covariance(trials[i], noise);
      const double d2 = residuals[i].dot(cov.inverse() * residuals[i]);
      const double bounded = d2 > kFarSquared ? kFarSquared + std::log1p(d2 - kFarSquared) : d2;
      sum += 0.5 * (std::log(cov.determinant()) + bounded);
    }
    return sum;
  }
};

}  // namespace

NoiseEstimate refit_drive_noise(std::span<const ResidualTrial> trials,
                                std::span<const Eigen::Vector3d> residuals,
                                const NoiseEstimate& start, bool fit_pose) {
  const Likelihood likelihood{trials, residuals, start, fit_pose};
  std::vector<double> x = {std::log(start.drive_common), std::log(start.drive_side)};
  if (fit_pose) {
    x.insert(x.end(), {std::log(start.pose.position_m), std::log(start.pose.heading_rad)});
  }
  nlopt::opt search(nlopt::LN_NELDERMEAD, static_cast<unsigned>(x.size()));
  search.set_min_objective(
      [](unsigned n, const double* at, double*, void* self) {
        const auto* l = static_cast<const Likelihood*>(self);
        return l->negative(l->at(std::vector<double>(at, at + n)));
      },
      const_cast<Likelihood*>(&likelihood));
  search.set_lower_bounds(std::vector<double>(x.size(), std::log(1e-4)));
  search.set_upper_bounds(std::vector<double>(x.size(), std::log(0.5)));
  search.set_initial_step(0.3);
  search.set_xtol_abs(0.01);
  search.set_maxeval(200);
  double value = 0;
  try {
    search.optimize(x, value);
  } catch (const std::exception&) {
    return start;  // roundoff stops the search where nothing is left to gain
  }
  return likelihood.at(x);
}

}  // namespace gapfarm
