// An interval of numbers, in the unit of whatever it is one of.
#pragma once

namespace gapfarm {

struct Interval {
  double lower = 0;
  double upper = 0;
  bool operator==(const Interval&) const = default;
};

}  // namespace gapfarm
