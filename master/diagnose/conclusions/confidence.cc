#include "master/diagnose/conclusions/confidence.h"

#include <algorithm>
#include <cmath>

#include "common/math/laws.h"

namespace gapfarm {
namespace {

// What the blind checks of docs/diagnosis.md and scripts/transform_logs.py counted.
struct Counts {
  double of, hits;
};
constexpr Counts kRightNames = {99, 98};       // 36 single effects, 31 pairs
constexpr Counts kNullsWithAName = {120, 1};   // logs with nothing in them
constexpr Counts kRightWarnings = {121, 121};  // 11 logs, each the wrong way round in 11 ways

constexpr double kTail = 0.05;

// Of the posterior after Jeffreys's prior; it leaves room however good the record is.
double posterior(const Counts& c, double share) {
  return beta_quantile(c.hits + 0.5, c.of - c.hits + 0.5, share);
}
double at_least(const Counts& c) { return posterior(c, kTail); }
double at_most(const Counts& c) { return posterior(c, 1 - kTail); }

}  // namespace

double confidence_of(double gain, double least_gain) {
  // What luck gains falls off by e a nat.
  const double luck = at_most(kNullsWithAName) * std::exp(-std::max(0.0, gain - least_gain));
  return at_least(kRightNames) - luck;
}

double sanity_confidence() { return at_least(kRightWarnings); }

}  // namespace gapfarm
