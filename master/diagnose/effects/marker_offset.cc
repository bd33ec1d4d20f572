#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

extern const EffectDiagnosis kMarkerOffset = {
    .effect = "marker_offset",
    .steps = {{"x", 0.005, true}, {"y", 0.005, true}},
    .aliases = {"com_offset"},
    .model_error = 0.03,
    .phrases = {"The marker sits %1 ahead and %2 left of the turning centre",
                {{"x", 1000, " mm"}, {"y", 1000, " mm"}}},
    .short_phrases = ShortPhrases{"x", 1000, " mm", "The marker is not over the turning centre",
                                  nullptr, "Move the marker, or correct its poses"},
};

}  // namespace gapfarm
