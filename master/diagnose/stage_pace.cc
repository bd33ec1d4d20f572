#include "master/diagnose/stage_pace.h"

#include <algorithm>

#include "master/diagnose/diagnose.h"

namespace gapfarm {

void StagePace::begin(const std::string& stage, double now_s) {
  for (std::size_t k = 0; k < kDiagnosisStages.size(); ++k) {
    if (stage != kDiagnosisStages[k].name) continue;
    if (!begun_) first_s_ = now_s;
    begun_ = true;
    stage_ = k;
    stage_s_ = now_s;
  }
}

std::optional<double> StagePace::time_left_s(double now_s) const {
  if (!begun_ || now_s <= first_s_) return std::nullopt;
  double before = 0, after = 0;  // shares
  for (std::size_t k = 0; k < kDiagnosisStages.size(); ++k) {
    if (k < stage_) before += kDiagnosisStages[k].share;
    if (k > stage_) after += kDiagnosisStages[k].share;
  }
  const double own = kDiagnosisStages[stage_].share;
  const double gone = now_s - first_s_, in_stage = now_s - stage_s_;
  // As the stages before had it; once this one takes longer than that, as it has it.
  const double as_before = before > 0 ? (gone - in_stage) / before : 0;
  const double whole = std::max(as_before, gone / (before + own));
  const double own_left = std::max(0.0, own * whole - in_stage);
  return own_left + after * whole;
}

}  // namespace gapfarm
