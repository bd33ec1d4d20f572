// What observations that a fit has not seen are worth under it, by closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "common/parameters/table.h"
#include "master/infer/fit.h"

namespace gapfarm::infer {
namespace {

Result<std::vector<std::optional<std::vector<Pose>>>> at_rest(
    const std::vector<PredictionRequest>& points) {
  return std::vector<std::optional<std::vector<Pose>>>(
      points.size(), std::vector<Pose>(points.front().trials.size()));
}

// Ends along x of one coordinate that is known to first order: of the first observation it moves
// the end by `lever`, of the others by 1.  Every one is a fold.
Observations levered(double lever, const std::vector<double>& ends) {
  Observations o;
  o.columns = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * ends.size()), 1);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    o.measured.push_back({ends[i], 0, 0});
    o.whitener.push_back(Eigen::Matrix3d::Identity());
    o.fold.push_back(i);
    o.asked.push_back(static_cast<std::uint32_t>(i));
    o.columns(static_cast<Eigen::Index>(3 * i), 0) = i == 0 ? lever : 1;
  }
  o.loss = Loss::kHuber;  // near its middle a Gaussian
  o.least_scale = o.most_scale = 1;
  return o;
}

TEST(InferHeldOut, AnObservationIsAsUncertainAsWhatTheOthersLeaveOpen) {
  const double lever = 3;
  const std::vector<double> ends = {1.2, 0.3, -0.1, 0.5, 0.4};
  const Observations o = levered(lever, ends);
  const Space space(push_table(), columns(1));
  const Forward forward = at_rest;
  const Fitter fitter(forward, o, space);
  Fit fit = fitter.start(Eigen::VectorXd::Zero(1)).value();
  ASSERT_TRUE(fitter.improve(&fit, 5));
  ASSERT_TRUE(fitter.differentiate(&fit));
  // The prior of a column has standard deviation 1: so many observations, and one more.
  const double others = 4, precision = others + 1;
  const double guess = (0.3 - 0.1 + 0.5 + 0.4) / precision;
  const double variance = 1 + lever * lever / precision;
  const double miss = ends[0] - lever * guess;
  EXPECT_NEAR(fitter.held_out(fit)[0], -0.5 * (miss * miss / variance + std::log(variance)), 1e-6);
}

}  // namespace
}  // namespace gapfarm::infer
