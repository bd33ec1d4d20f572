#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

extern const EffectDiagnosis kBacklash = {
    .effect = "backlash",
    .steps = {{"travel", 0.004, false}},
    .model_error = 0.1,
    .phrases = {"A side that changes direction first loses %1 of travel",
                {{"travel", 1000, " mm"}}},
    .short_phrases =
        ShortPhrases{"travel", 1000, " mm", "A side that changes direction first loses % of travel",
                     nullptr, "Take up the play before a drive"},
};

}  // namespace gapfarm
