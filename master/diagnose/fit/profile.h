// How far the data let a parameter go while all others follow it.
#pragma once

#include <vector>

#include "common/base/result.h"
#include "master/diagnose/fit/estimate.h"

namespace gapfarm {

// A fit with its base, looked at to either side of each of its effects' parameters, where the
// others are fitted again (the likelihood's profile: Bates and Watts 1988).  Where that is downhill
// the fit goes on from there; where it rises by less than slopes say, because the valley is bent,
// the standard error is so much wider.  Errors: the farm's.
Result<JointFit> profiled(Predictor& predictor, const Study& study,
                          const std::vector<EffectCandidate>& effects, JointFit fit);

}  // namespace gapfarm
