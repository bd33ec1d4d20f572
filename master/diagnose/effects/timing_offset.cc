#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

extern const EffectDiagnosis kTimingOffset = {
    .effect = "timing_offset",
    .steps = {{"offset", 0.02, true}},
    .changes_reach = true,
    .family = &kReachFamily,
    .aliases = {"motor_lag"},
    .model_error = 0.06,
    .phrases = {"The motors run longer than commanded by %1", {{"offset", 1000, " ms"}}},
    .short_phrases =
        ShortPhrases{"offset", 1000, " ms", "The motors run % longer than commanded",
                     "The motors run % shorter than commanded", "Correct the commanded time by %"},
};

}  // namespace gapfarm
