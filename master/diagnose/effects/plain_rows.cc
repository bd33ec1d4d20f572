// Effects of which a row says all.
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

extern const EffectDiagnosis kTimingOffset = {
    .effect = "timing_offset",
    .steps = {{"offset", 0.02, true}},
    .changes_reach = true,
    .family = &kReachFamily,
    .aliases = {"motor_lag"},
    .model_error = 0.06,
    .phrases = {"The motors run longer than commanded by %1", {{"offset", 1000, " ms"}}},
    .short_phrases =
        ShortPhrases{"offset", 1000, " ms", "The motors run % longer than commanded",
                     "The motors run % shorter than commanded", "Correct the commanded time by %"},
};

extern const EffectDiagnosis kBatterySag = {
    .effect = "battery_sag",
    .steps = {{"rate", 0.002, true}},
    .model_error = 0.03,
    .phrases = {"The battery loses %1 of its speed a minute", {{"rate", 100, " %"}}},
    .short_phrases = ShortPhrases{"rate", 100, " %", "The battery loses % of its speed a minute",
                                  "The robot gains % of its speed a minute",
                                  "Charge before a session, or keep sessions short"},
};

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

extern const EffectDiagnosis kCameraAspect = {
    .effect = "camera_aspect",
    .steps = {{"ratio", 0.02, true}},
    .model_error = 0.02,
    .phrases = {"The camera's y scale is %1 times its x scale", {{"ratio", 1, ""}}},
    .short_phrases = ShortPhrases{"ratio", 1, "", "The camera's y scale is % times its x scale",
                                  nullptr, "Calibrate the camera's scales"},
};

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

// Looked for in the tails of what is left (slip.h).
extern const EffectDiagnosis kSlipEvents = {
    .effect = "slip_events",
    .phrases = {"In %1 of the trials a side slips and loses up to %2 of its speed",
                {{"probability", 100, " %"}, {"loss", 100, " %"}}},
    .short_phrases = ShortPhrases{"probability", 100, " %", "In % of the drives a side slips",
                                  nullptr, "Clean the treads and the floor"},
    .found = "by the tails of what is left",
    .missing = "single drives are no outliers as slips would make them",
};

// Looked for in readings that the next ones contradict (latency.h).
extern const EffectDiagnosis kPoseLatency = {
    .effect = "pose_latency",
    .phrases = {"In %1 of the trials a pose is %2 old",
                {{"share", 100, " %"}, {"latency", 1000, " ms"}}},
    .short_phrases = ShortPhrases{"share", 100, " %", "% of the poses were read too early", nullptr,
                                  "Let the robot rest before its pose is read"},
};

// Seen in the logged digits themselves.
extern const EffectDiagnosis kPoseQuantisation = {
    .effect = "pose_quantisation",
    .phrases = {"Positions are rounded to a grid of %1", {{"step", 1000, " mm"}}},
    .short_phrases =
        ShortPhrases{"step", 1000, " mm", "Positions are rounded to %", nullptr, "Log more digits"},
    .found = "the positions lie on this grid",
    .missing = "the positions lie on no grid",
};

}  // namespace gapfarm
