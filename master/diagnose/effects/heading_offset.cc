#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

extern const EffectDiagnosis kHeadingOffset = {
    .effect = "heading_offset",
    .steps = {{"angle", 0.02, true}},
    .phrases = {"The marker's heading is %1 to the left of the robot's",
                {{"angle", 1000, " mrad"}}},
    .short_phrases =
        ShortPhrases{"angle", 1000, " mrad", "The marker is turned % to the left on the robot",
                     "The marker is turned % to the right on the robot",
                     "Turn the marker back by %"},
};

}  // namespace gapfarm
