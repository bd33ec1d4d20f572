// Effects on what the floor or the table does, and on what lies or is pushed on it.
#include "worker/effects/behaviour.h"
#include "worker/sim/push/push.h"

namespace gapfarm {
namespace {

// A direction on the floor, as the robot or the piece meets it.
double as_met(double direction_rad, const Situation& situation) {
  return wrap_angle(direction_rad - situation.X_WR.theta);
}

// p: angle, direction; under a robot or a piece.
void tilt(EffectValues p, const Situation& situation, Floor& floor) {
  floor.tilt_rad = p[0];
  floor.tilt_direction_rad = as_met(p[1], situation);
}

// p: x, y.
template <class Settings>
void shift_mass(EffectValues p, Settings& settings) {
  settings.com_x_m += p[0];
  settings.com_y_m += p[1];
}

enum Patch : std::size_t { kRatio, kPatchX, kPatchY, kRadius };

// Of a first and a second patch each takes the next disc that does nothing yet.
void lay_patch(EffectValues p, const Situation& situation, Floor& floor) {
  if (situation.far_away) return;
  const Pose centre_S = between(situation.X_WR, {p[kPatchX], p[kPatchY], 0});
  for (FrictionDisc& disc : floor.patches) {
    if (disc.ratio != 1) continue;
    disc = {centre_S.x, centre_S.y, p[kRadius], p[kRatio]};
    return;
  }
}

constexpr EffectBehaviour kFloorEffects[] = {
    {.name = "floor_tilt", .floor = tilt},
    {.name = "table_tilt", .floor = tilt},
    {.name = "floor_nap",  // p: strength, direction
     .floor =
         [](EffectValues p, const Situation& situation, Floor& floor) {
           floor.nap_strength = p[0];
           floor.nap_direction_rad = as_met(p[1], situation);
         }},
    {.name = "friction_patch", .floor = lay_patch},
    {.name = "rolling_resistance",
     .floor = [](EffectValues p, const Situation&,
                 Floor& floor) { floor.rolling_resistance += p[0]; }},
    {.name = "com_offset", .settings = shift_mass<SimSettings>, .push = shift_mass<PushSettings>},
    {.name = "friction_anisotropy",  // p: ratio, direction
     .floor =
         [](EffectValues p, const Situation& situation, Floor& floor) {
           floor.grain_ratio = p[0];
           floor.grain_direction_rad = as_met(p[1], situation);
         }},
    {.name = "friction_speed",
     .floor = [](EffectValues p, const Situation&, Floor& floor) { floor.speed_slope_s_m = p[0]; }},
    {.name = "pressure_distribution",  // p: stretch, direction
     .push =
         [](EffectValues p, PushSettings& settings) {
           settings.stretch = p[0];
           settings.stretch_direction_rad = p[1];
         }},
    {.name = "finger_compliance",
     .push = [](EffectValues p, PushSettings& settings) { settings.finger_compliance_m_n = p[0]; }},
};

}  // namespace

std::span<const EffectBehaviour> floor_effects() { return kFloorEffects; }

}  // namespace gapfarm
