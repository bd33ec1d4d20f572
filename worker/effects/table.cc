#include "worker/effects/table.h"

#include <array>

#include "worker/effects/behaviour.h"

namespace gapfarm {

std::span<const EffectBehaviour* const> effect_behaviours() {
  using namespace effects;  // NOLINT: the rows below are all of it
  static const std::array<const EffectBehaviour*, 25> rows = {
      &motor_asymmetry,
      &motor_deadband,
      &motor_lag,
      &timing_offset,
      &battery_sag,
      &backlash,
      &slip_events,
      &floor_tilt,
      &floor_nap,
      &friction_patch,
      &rolling_resistance,
      &com_offset,
      &camera_aspect,
      &camera_distortion,
      &camera_seam,
      &heading_offset,
      &marker_offset,
      &pose_latency,
      &pose_quantisation,
      &friction_anisotropy,
      &friction_speed,
      &table_tilt,
      &pressure_distribution,
      &finger_compliance,
      &placement_bias,
  };
  return rows;
}

}  // namespace gapfarm
