// Tests and intervals that look at ranks or counts alone.
#pragma once

#include <span>
#include <vector>

#include "common/math/statistics.h"

namespace gapfarm {

struct RankTest {
  double statistic = 0;
  double p = 1;  // two-sided
};

// Mann and Whitney's U (1947) of the first sample, half a point a tie.  Exact when neither sample
// has ties with itself or the other and both hold at most 30 values; otherwise normal with
// tie-corrected variance and a continuity correction.  REQUIRES: both not empty, all finite.
RankTest mann_whitney(std::span<const double> a, std::span<const double> b);

// Friedman's chi-square (1937) with the correction for ties; `values[i][j]` is treatment j in block
// i.  p = 1 when every block ties throughout.  REQUIRES: equally long blocks, two treatments at
// least.
RankTest friedman(const std::vector<std::vector<double>>& values);

// Distribution-free interval of the median between two order statistics, of the least coverage that
// reaches `coverage`; NaN when none does: of five values not even all cover 95 %.
Interval median_interval(std::span<const double> values, double coverage);

// Wilson's score interval (1927) of a share.  REQUIRES: successes <= trials.
Interval wilson_interval(std::size_t successes, std::size_t trials, double coverage);

// Ranks from 1, means of them for ties.
std::vector<double> mean_ranks(std::span<const double> values);

}  // namespace gapfarm
