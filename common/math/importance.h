// How much of an output's variance one input explains, of data as they are.
#pragma once

#include <cstddef>
#include <span>

namespace gapfarm {

inline constexpr std::size_t kLeastForImportance = 40;  // points

// First-order Sobol index of `x` on `y`: the variance of y's mean given x over y's variance, from
// given data by classes of x with as many points each (Plischke, Borgonovo and Smith, European
// Journal of Operational Research 226, 2013), no class splitting equal x, less what chance alone
// would give (as adjusted R squared).  In [0, 1]; 0 of fewer than kLeastForImportance points, and
// where y does not vary.  What x does together with another input does not count, and where inputs
// go together, each has the share of both.  REQUIRES: as many x as y.
double first_order_index(std::span<const double> x, std::span<const double> y);

}  // namespace gapfarm
