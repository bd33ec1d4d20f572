#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

extern const EffectDiagnosis kMotorDeadband = {
    .effect = "motor_deadband",
    .steps = {{"duty", 0.005, false}},
    .changes_reach = true,
    .family = &kReachFamily,
    .aliases = {"rolling_resistance"},
    .model_error = 0.1,
    .phrases = {"Duty below %1 moves nothing and is lost above it", {{"duty", 1, ""}}},
    .short_phrases = ShortPhrases{"duty", 100, " %", "Duty below % moves nothing", nullptr,
                                  "Add % of duty to every command"},
};

}  // namespace gapfarm
