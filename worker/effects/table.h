// The implementations, one a file of the same name.
#pragma once

namespace gapfarm {

struct EffectBehaviour;

namespace effects {

extern const EffectBehaviour motor_asymmetry, motor_deadband, motor_lag, timing_offset, battery_sag,
    backlash, slip_events, floor_tilt, floor_nap, friction_patch, rolling_resistance, com_offset,
    camera_aspect, camera_distortion, camera_seam, heading_offset, marker_offset, pose_latency,
    pose_quantisation, friction_anisotropy, friction_speed, table_tilt, pressure_distribution,
    finger_compliance, placement_bias;

}  // namespace effects
}  // namespace gapfarm
