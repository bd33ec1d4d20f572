#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

extern const EffectDiagnosis kMotorLag = {
    .effect = "motor_lag",
    .steps = {{"tau", 0.1, false}},
    .changes_reach = true,
    .family = &kReachFamily,
    .aliases = {"timing_offset"},  // how hard the motors brake decides what remains after lag
    .model_error = 0.4,
    .phrases = {"The motors follow their duty with a lag of %1", {{"tau", 1000, " ms"}}},
    .short_phrases =
        ShortPhrases{"tau", 1000, " ms", "The motors follow their duty with a lag of %", nullptr,
                     "Give the simulated motors that lag"},
};

}  // namespace gapfarm
