// The smallest box along the axes that holds some places.
#pragma once

#include <algorithm>

#include "common/pose/pose.h"

namespace gapfarm {

struct Extent {
  double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;

  void add(const Pose& X) {
    x0 = std::min(x0, X.x), x1 = std::max(x1, X.x);
    y0 = std::min(y0, X.y), y1 = std::max(y1, X.y);
  }
  double longer_side() const { return std::max(x1 - x0, y1 - y0); }
};

}  // namespace gapfarm
