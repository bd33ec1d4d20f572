#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

// Looked for in readings that the next ones contradict (latency.h).
extern const EffectDiagnosis kPoseLatency = {
    .effect = "pose_latency",
    .phrases = {"In %1 of the trials a pose is %2 old",
                {{"share", 100, " %"}, {"latency", 1000, " ms"}}},
    .short_phrases = ShortPhrases{"share", 100, " %", "% of the poses were read too early", nullptr,
                                  "Let the robot rest before its pose is read"},
};

}  // namespace gapfarm
