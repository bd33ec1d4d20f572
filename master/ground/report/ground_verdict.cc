#include "master/ground/report/ground_verdict.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "master/ground/tolerances.h"

namespace gapfarm {

bool may_be_named(const HeldOutGain& gain) { return std::isfinite(gain.lo) && gain.lo > 0; }

bool nothing_is_left(const GroundFigures& figures) {
  const HeldOutGain& left = figures.closable;
  return std::isfinite(left.mean) && std::isfinite(left.hi) &&
         std::max(left.mean, left.hi) <= kToleratedGap;
}

Verdict ground_verdict(const GroundFigures& figures) {
  assert(std::all_of(figures.named.begin(), figures.named.end(), may_be_named));
  const bool named = figures.faults > 0 || !figures.named.empty();
  if (nothing_is_left(figures)) return named ? Verdict::kEffect : Verdict::kNone;
  return named ? Verdict::kEffectAndUnknown : Verdict::kUnknown;
}

std::string verdict_reason(const GroundFigures& figures) {
  const HeldOutGain& left = figures.closable;
  const std::string closes =
      fmt::format("{:.2g} [{:.2g}, {:.2g}] nats a window", left.mean, left.lo, left.hi);
  if (nothing_is_left(figures)) {
    return fmt::format(
        "All that was tried would close another {} on stretches that were not fitted: within "
        "{:.2g}, "
        "residuals 10 % smaller.",
        closes, kToleratedGap);
  }
  if (left.lo > 0) {
    const std::string what = figures.best_of_all.empty() ? "" : ", " + figures.best_of_all + ",";
    return fmt::format(
        "The best of what was tried{} closes another {} on stretches that were not fitted, and "
        "{:.2g} (residuals 10 % smaller) is tolerated: something moves the robot that is not "
        "named.",
        what, closes, kToleratedGap);
  }
  return fmt::format(
      "The best of what was tried would close another {} on stretches that were not fitted: these "
      "runs do not exclude a gap of more than {:.2g} (residuals 10 % smaller); log more runs.",
      closes, kToleratedGap);
}

}  // namespace gapfarm
