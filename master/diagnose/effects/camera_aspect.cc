#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

extern const EffectDiagnosis kCameraAspect = {
    .effect = "camera_aspect",
    .steps = {{"ratio", 0.02, true}},
    .model_error = 0.02,
    .phrases = {"The camera's y scale is %1 times its x scale", {{"ratio", 1, ""}}},
    .short_phrases = ShortPhrases{"ratio", 1, "", "The camera's y scale is % times its x scale",
                                  nullptr, "Calibrate the camera's scales"},
};

}  // namespace gapfarm
