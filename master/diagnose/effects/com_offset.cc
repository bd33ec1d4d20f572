#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

extern const EffectDiagnosis kComOffset = {
    .effect = "com_offset",
    .steps = {{"x", 0.003, true}, {"y", 0.003, true}},
    .aliases = {"marker_offset"},
    .model_error = 0.15,
    .phrases = {"The centre of mass lies %1 ahead and %2 left of the treads' centre",
                {{"x", 1000, " mm"}, {"y", 1000, " mm"}}},
    .short_phrases =
        ShortPhrases{"x", 1000, " mm", "The centre of mass is off the middle of the treads",
                     nullptr, "Weigh the robot's ends, or move its load"},
};

}  // namespace gapfarm
