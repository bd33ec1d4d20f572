#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

// Seen in the logged digits themselves.
extern const EffectDiagnosis kPoseQuantisation = {
    .effect = "pose_quantisation",
    .phrases = {"Positions are rounded to a grid of %1", {{"step", 1000, " mm"}}},
    .short_phrases =
        ShortPhrases{"step", 1000, " mm", "Positions are rounded to %", nullptr, "Log more digits"},
};

}  // namespace gapfarm
