// A parameter as a report shows it: before and after, with its interval and its bounds.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/parameters/table.h"

namespace gapfarm {

enum class BoundHit { kNone, kLower, kUpper };

struct ParameterRow {
  std::string key;     // "full_speed", "camera_seam.position"
  std::string unit;    // "-" without one
  std::string effect;  // it belongs to; empty: base
  std::string summary;
  std::optional<double> before;  // none: what it belongs to was not there
  double after = 0;
  std::optional<double> lo, hi;  // 90 % interval of `after`; none: not known
  double lower = 0, upper = 0;   // what was searched between
  std::string choice;            // the value's name, where it is one of several
  std::string note;              // "the data hardly move it"; may be empty
  std::string choice_before{};   // the name of `before`, where that is known
};

// Without an interval, over the parameter's own bounds.
ParameterRow row_of(const Parameter& parameter, std::optional<double> before, double after);

// Two parameters that make up for one another in the fit.
struct ParameterCorrelation {
  std::string a, b;
  double r = 0;  // [-1, 1]
};

// Below it a correlation is not worth a line.
inline constexpr double kStrongCorrelation = 0.8;

// Whether `after` lies within a thousandth of the range from a bound.  A bound that is zero is no
// hit: a size that ends there was not cut off by the search.  Nor are the ends of a circle.
BoundHit bound_hit(const ParameterRow& row);
std::vector<std::string> keys_at_bounds(std::span<const ParameterRow> rows);

}  // namespace gapfarm
