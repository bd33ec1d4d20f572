#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

extern const EffectDiagnosis kBatterySag = {
    .effect = "battery_sag",
    .steps = {{"rate", 0.002, true}},
    .model_error = 0.03,
    .phrases = {"The battery loses %1 of its speed a minute", {{"rate", 100, " %"}}},
    .short_phrases = ShortPhrases{"rate", 100, " %", "The battery loses % of its speed a minute",
                                  "The robot gains % of its speed a minute",
                                  "Charge before a session, or keep sessions short"},
};

}  // namespace gapfarm
