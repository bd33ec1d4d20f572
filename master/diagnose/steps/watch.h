// What each step found, told to who watches before there is a report.  Every number may still move.
#pragma once

#include <vector>

#include "master/diagnose/steps/steps.h"

namespace gapfarm::steps {

void tell_of_base(const Inquiry& of, const Study& study);
void tell_of_noise(const Inquiry& of, const Study& study);
void tell_of_candidates(const Inquiry& of, const std::vector<EffectCandidate>& candidates);
// Sizes of the effects, as far as they have been fitted together.
void tell_of_fit(const Inquiry& of, const JointFit& fit);
void tell_of_readings(const Inquiry& of, const Explanation& found);
void tell_of_choice(const Inquiry& of, const Explanation& found, bool doubted);
void tell_of_verdict(const Inquiry& of, const Judgement& judged);
// On trials that the fits did not see.
void tell_of_gaps(const Inquiry& of, const std::vector<NestedFit>& nested);

}  // namespace gapfarm::steps
