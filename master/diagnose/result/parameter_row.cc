#include "master/diagnose/result/parameter_row.h"

#include <cmath>

#include "master/infer/settings.h"

namespace gapfarm {

ParameterRow row_of(const Parameter& p, std::optional<double> before, double after) {
  ParameterRow row{p.key, p.unit, p.effect, p.summary, before, after,
                   {},    {},     p.lower,  p.upper,   "",     ""};
  const auto name = [&](double value) { return p.choices.at(static_cast<std::size_t>(value)); };
  if (!p.choices.empty()) row.choice = name(after);
  if (!p.choices.empty() && before) row.choice_before = name(*before);
  return row;
}

BoundHit bound_hit(const ParameterRow& row) {
  const double range = row.upper - row.lower;
  const bool round = row.key.ends_with(".direction") || row.key == "direction";
  if (!row.choice.empty() || round || !(range > 0) || !std::isfinite(row.after)) {
    return BoundHit::kNone;
  }
  if (row.lower != 0 && row.after - row.lower <= kAtBound * range) return BoundHit::kLower;
  if (row.upper != 0 && row.upper - row.after <= kAtBound * range) return BoundHit::kUpper;
  return BoundHit::kNone;
}

std::vector<std::string> keys_at_bounds(std::span<const ParameterRow> rows) {
  std::vector<std::string> keys;
  for (const ParameterRow& row : rows) {
    if (bound_hit(row) != BoundHit::kNone) keys.push_back(row.key);
  }
  return keys;
}

}  // namespace gapfarm
