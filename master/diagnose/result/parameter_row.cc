#include "master/diagnose/result/parameter_row.h"

#include <cmath>

namespace gapfarm {

BoundHit bound_hit(const ParameterRow& row) {
  constexpr double kNear = 1e-3;  // of the range
  const double range = row.upper - row.lower;
  const bool round = row.key.ends_with(".direction") || row.key == "direction";
  if (!row.choice.empty() || round || !(range > 0) || !std::isfinite(row.after)) {
    return BoundHit::kNone;
  }
  if (row.lower != 0 && row.after - row.lower <= kNear * range) return BoundHit::kLower;
  if (row.upper != 0 && row.upper - row.after <= kNear * range) return BoundHit::kUpper;
  return BoundHit::kNone;
}

}  // namespace gapfarm
