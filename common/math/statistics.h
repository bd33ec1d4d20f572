// Summary statistics, resampling and corrections for many looks.  Pure functions; randomness is
// passed in.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "common/base/ranges.h"
#include "common/random/stream.h"

namespace gapfarm {

// 0 of no values.
double mean(std::span<const double> values);

// The median; the mean of the middle two for an even count.  REQUIRES: not empty, all finite.
double median(std::span<const double> values);

// Standard deviation about `centre` by the median deviation, as of a Gaussian.  REQUIRES: as
// median().
double median_deviation(std::span<const double> values, double centre = 0);

// Sample quantile, linear between order statistics (type 7 of Hyndman and Fan 1996).
// REQUIRES: not empty, all finite, `share` in [0, 1].
double quantile(std::span<const double> values, double share);

// Direction of the summed unit vectors, rad in (-pi, pi]; 0 for no angles or a sum of zero.
double circular_mean(std::span<const double> angles_rad);

// A centre to measure headings from: the circular mean, moved twice to the median of the wrapped
// deviations from it, so that a minority of wild headings hardly shifts it.  rad in (-pi, pi].
double circular_centre(std::span<const double> angles_rad);

struct MeanCovariance {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

// Mean and covariance of the columns of `points` (dimension x count) under weights >= 0.  The
// covariance is divided by V1 - V2 / V1 (V1, V2: sums of the weights and of their squares), which
// is n - 1 for unit weights; a zero matrix when that is not positive.
// REQUIRES: one weight a point and a positive sum.
MeanCovariance weighted_mean_covariance(const Eigen::MatrixXd& points,
                                        std::span<const double> weights);

// Indices of one bootstrap sample that draws whole blocks with replacement until as many blocks are
// drawn as there are, less those spared; `blocks[i]` lists the indices of block i (a session, say).
std::vector<std::size_t> resample_blocks(std::span<const std::vector<std::size_t>> blocks,
                                         Stream& stream, std::size_t spared = 0);

// Percentile interval of `statistic` over `repeats` block bootstrap samples (Efron 1979; Kuensch
// 1989).  `coverage` in (0, 1); of few blocks one is spared, lest their scatter be taken for small.
// REQUIRES: blocks and repeats are not empty / zero.
Interval bootstrap_interval(std::span<const std::vector<std::size_t>> blocks,
                            const std::function<double(std::span<const std::size_t>)>& statistic,
                            double coverage, unsigned repeats, Stream& stream,
                            std::size_t spared = 0);

// Adjusted p-values in the input's order, each in [0, 1]: rejecting those below a level keeps the
// family-wise error at that level (Holm 1979).
std::vector<double> holm(std::span<const double> p_values);

inline constexpr std::size_t kLeastForImportance = 40;  // points

// How much of an output's variance one input explains: the first-order Sobol index of `x` on `y`,
// the variance of y's mean given x over y's variance, from given data by classes of x with as many
// points each (Plischke, Borgonovo and Smith, European Journal of Operational Research 226, 2013),
// no class splitting equal x, less what chance alone would give (as adjusted R squared).  In [0,
// 1]; 0 where y does not vary.  What x does together
// with another input does not count, and where inputs go together, each has the share of both.
// REQUIRES: as many x as y, kLeastForImportance at least.
double first_order_index(std::span<const double> x, std::span<const double> y);

}  // namespace gapfarm
