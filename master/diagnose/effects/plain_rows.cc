// Effects of which a row says all.
#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {

extern const EffectDiagnosis kMotorAsymmetry = {
    .effect = "motor_asymmetry",
    .steps = {{"ratio", 0.02, true}},
    .model_error = 0.04,
    .phrases = {"The right side runs faster than the left by %1",
                {{"ratio", 100, " %"}},
                "Even out the duties of the two sides, which are %1 apart",
                "The right side runs %1 faster than the left",
                "The right side runs %1 slower than the left"},
};

extern const EffectDiagnosis kMotorDeadband = {
    .effect = "motor_deadband",
    .steps = {{"duty", 0.005, false}},
    .changes_reach = true,
    .aliases = {"rolling_resistance"},
    .model_error = 0.1,
    .phrases = {"Duty below %1 moves nothing and is lost above it",
                {{"duty", 100, " %"}},
                "Add %1 of duty to every command",
                "Duty below %1 moves nothing"},
};

extern const EffectDiagnosis kMotorLag = {
    .effect = "motor_lag",
    .steps = {{"tau", 0.1, false}},
    .changes_reach = true,
    .aliases = {"timing_offset"},  // how hard the motors brake decides what remains after lag
    .model_error = 0.4,
    .phrases = {"The motors follow their duty with a lag of %1",
                {{"tau", 1000, " ms"}},
                "Give the simulated motors that lag"},
};

extern const EffectDiagnosis kTimingOffset = {
    .effect = "timing_offset",
    .steps = {{"offset", 0.02, true}},
    .changes_reach = true,
    .aliases = {"motor_lag"},
    .model_error = 0.06,
    .phrases = {"The motors run longer than commanded by %1",
                {{"offset", 1000, " ms"}},
                "Correct the commanded time by %1",
                "The motors run %1 longer than commanded",
                "The motors run %1 shorter than commanded"},
};

extern const EffectDiagnosis kBatterySag = {
    .effect = "battery_sag",
    .steps = {{"rate", 0.002, true}},
    .model_error = 0.03,
    .phrases = {"The battery loses %1 of its speed a minute",
                {{"rate", 100, " %"}},
                "Charge before a session, or keep sessions short",
                nullptr,
                "The robot gains %1 of its speed a minute"},
};

extern const EffectDiagnosis kBacklash = {
    .effect = "backlash",
    .steps = {{"travel", 0.004, false}},
    .model_error = 0.1,
    .phrases = {"A side that changes direction first loses %1 of travel",
                {{"travel", 1000, " mm"}},
                "Take up the play before a drive"},
};

extern const EffectDiagnosis kRollingResistance = {
    .effect = "rolling_resistance",
    .steps = {{"coefficient", 0.05, false}},
    .changes_reach = true,
    .aliases = {"motor_deadband"},
    .model_error = 0.3,
    .phrases = {"Rolling drags with %1 of the weight",
                {{"coefficient", 100, " %"}},
                "Give the simulation that drag"},
};

extern const EffectDiagnosis kFloorTilt = {
    .effect = "floor_tilt",
    .searched = {{"angle", 0.03}},
    .polar = Polar{"floor_tilt.angle", "floor_tilt.direction", 1, false},
    .model_error = 0.3,
    .direction_error_rad = 0.02,
    .phrases = {"The floor falls by %1 toward %2",
                {{"angle", 1000, " mrad"}, {"direction", kDegrees, " degrees"}},
                "Level the floor",
                "The floor slopes by %1 toward %2"},
};

extern const EffectDiagnosis kFloorNap = {
    .effect = "floor_nap",
    .searched = {{"strength", 0.1}, {"direction", 0.2}},
    .model_error = 0.2,
    .direction_error_rad = 0.02,
    .phrases = {"The floor has a nap that drags with %1 of the weight against %2",
                {{"strength", 100, " %"}, {"direction", kDegrees, " degrees"}},
                "Drive on a floor without pile",
                "The floor has a nap that drags with %1 of the weight"},
};

extern const EffectDiagnosis kComOffset = {
    .effect = "com_offset",
    .steps = {{"x", 0.003, true}, {"y", 0.003, true}},
    .aliases = {"marker_offset"},
    .model_error = 0.15,
    .phrases = {"The centre of mass lies %1 ahead and %2 left of the treads' centre",
                {{"x", 1000, " mm"}, {"y", 1000, " mm"}},
                "Weigh the robot's ends, or move its load",
                "The centre of mass is off the middle of the treads"},
};

extern const EffectDiagnosis kCameraAspect = {
    .effect = "camera_aspect",
    .steps = {{"ratio", 0.02, true}},
    .model_error = 0.02,
    .phrases = {"The camera's y scale is %1 times its x scale",
                {{"ratio", 1, ""}},
                "Calibrate the camera's scales"},
};

extern const EffectDiagnosis kHeadingOffset = {
    .effect = "heading_offset",
    .steps = {{"angle", 0.02, true}},
    .phrases = {"The marker's heading is %1 to the left of the robot's",
                {{"angle", 1000, " mrad"}},
                "Turn the marker back by %1",
                "The marker is turned %1 to the left on the robot",
                "The marker is turned %1 to the right on the robot"},
};

extern const EffectDiagnosis kMarkerOffset = {
    .effect = "marker_offset",
    .steps = {{"x", 0.005, true}, {"y", 0.005, true}},
    .aliases = {"com_offset"},
    .model_error = 0.03,
    .phrases = {"The marker sits %1 ahead and %2 left of the turning centre",
                {{"x", 1000, " mm"}, {"y", 1000, " mm"}},
                "Move the marker, or correct its poses",
                "The marker is not over the turning centre"},
};

// Looked for in readings that the next ones contradict (latency.h).
extern const EffectDiagnosis kPoseLatency = {
    .effect = "pose_latency",
    .phrases = {"In %1 of the trials a pose is %2 old",
                {{"share", 100, " %"}, {"latency", 1000, " ms"}},
                "Let the robot rest before its pose is read",
                "%1 of the poses were read too early"},
};

// Seen in the logged digits themselves.
extern const EffectDiagnosis kPoseQuantisation = {
    .effect = "pose_quantisation",
    .phrases = {"Positions are rounded to a grid of %1",
                {{"step", 1000, " mm"}},
                "Log more digits",
                "Positions are rounded to %1"},
    .found = "the positions lie on this grid",
    .missing = "the positions lie on no grid",
};

}  // namespace gapfarm
