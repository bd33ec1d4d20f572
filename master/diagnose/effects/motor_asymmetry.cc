#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

extern const EffectDiagnosis kMotorAsymmetry = {
    .effect = "motor_asymmetry",
    .steps = {{"ratio", 0.02, true}},
    .model_error = 0.04,
    .phrases = {"The right side runs faster than the left by %1", {{"ratio", 100, " %"}}},
    .short_phrases = ShortPhrases{"ratio", 100, " %", "The right side runs % faster than the left",
                                  "The left side runs % faster than the right",
                                  "Trim the faster side's duty by %"},
};

}  // namespace gapfarm
