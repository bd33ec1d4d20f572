#include "master/diagnose/conclusions/verdict.h"

#include <algorithm>
#include <cmath>

#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "master/diagnose/evidence/noise.h"

namespace gapfarm {

double leftover_scale(const Regression& explained) {
  std::vector<double> squares;
  for (double z : studentised(explained, 0.2)) {
    if (z != 0) squares.push_back(z * z);  // rows of ignored trials are
  }
  return squares.empty()
             ? 1
             : std::clamp(median(squares) / 0.455, kLeastLeftoverScale, kMostLeftoverScale);
}

std::vector<Leftover> leftovers(const Regression& explained,
                                const std::vector<CovariateBlock>& blocks) {
  const double scale = leftover_scale(explained);
  std::vector<Leftover> all;
  for (const CovariateBlock& block : blocks) {
    const Gain gain = block.expected > 0 ? explained.gain_beyond(block.columns, block.expected)
                                         : explained.gain(block.columns);
    if (gain.dimensions == 0) continue;
    const double p = chi_squared_above(gain.dimensions, gain.squares / scale);
    all.push_back({block.name, std::log10(std::max(p, 1e-300)),
                   std::max(0.0, (gain.squares - gain.dimensions * scale) / 2)});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Leftover& a, const Leftover& b) { return a.log10_p < b.log10_p; });
  return all;
}

Verdict judge_verdict(bool named, double explained_nats, const std::vector<Leftover>& left,
                      double unknown_log10_p, double wrong_share) {
  const bool unknown = !left.empty() && left.front().log10_p < unknown_log10_p;
  if (!unknown) return named ? Verdict::kEffect : Verdict::kNone;
  if (!named || left.front().excess > wrong_share * std::max(explained_nats, 1.0)) {
    return Verdict::kUnknown;
  }
  return Verdict::kEffectAndUnknown;
}

}  // namespace gapfarm
