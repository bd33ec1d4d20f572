// From what was chosen and what is left to the words of the verdict.
#pragma once

#include <string>
#include <vector>

#include "master/diagnose/evidence/covariates.h"
#include "master/diagnose/fit/regression.h"
#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

// How strongly the leftover residuals still depend on a block of covariates.
struct Leftover {
  std::string covariate;
  double log10_p = 0;
  double excess = 0;  // nats over all trials beyond what chance explains
};

// Variance of what is left over the noise's, the degrees of freedom that were spent given back:
// robust, and bounded since the noise was measured.
double leftover_scale(const Regression& explained);
inline constexpr double kLeastLeftoverScale = 0.9, kMostLeftoverScale = 1.4;

// Most significant first.
std::vector<Leftover> leftovers(const Regression& explained,
                                const std::vector<CovariateBlock>& blocks);

// Leftovers beyond this share of what the named effects explain mean that they are not the cause.
// Right effects left 1 to 4 %, effects outside the catalogue under a wrong name 18 % and more.
inline constexpr double kWrongShare = 0.15;

// Two seams bend to much that is none: a heading read askew left 15 % beside two, the two seams of
// the real forward log leave 5 %.
inline constexpr double kWrongShareOfTwo = 0.09;

// `explained_nats`: by the named effects.  Whether they are to be believed at all is the caller's
// to drop when the verdict is kUnknown.  A leftover dependence below `unknown_log10_p` is not
// chance.
Verdict judge_verdict(bool named, double explained_nats, const std::vector<Leftover>& left,
                      double unknown_log10_p, double wrong_share = kWrongShare);

}  // namespace gapfarm
