// What each step found, sent to who watches before there is a report.  Every number may still move.
#pragma once

#include <vector>

#include "master/diagnose/steps/steps.h"

namespace gapfarm::steps {

void emit_base(const DiagnosisRequest& of, const Study& study);
void emit_noise(const DiagnosisRequest& of, const Study& study);
void emit_candidates(const DiagnosisRequest& of, const std::vector<EffectCandidate>& candidates);
void emit_fit(const DiagnosisRequest& of, const JointFit& fit);
void emit_readings(const DiagnosisRequest& of, const Explanation& found);
void emit_choice(const DiagnosisRequest& of, const Explanation& found, bool has_warnings);
void emit_verdict(const DiagnosisRequest& of, const Judgement& judged);
void emit_gaps(const DiagnosisRequest& of, const std::vector<NestedFit>& nested);

}  // namespace gapfarm::steps
