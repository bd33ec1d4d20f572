#include "common/parameters/racquetball.h"

#include <cassert>

namespace gapfarm {
namespace {

using enum ParameterKind;
using enum ParameterScale;

Parameter real(const char* key, const char* unit, double lower, double upper, double nominal,
               const char* summary, ParameterScale scale = kLinear) {
  return {key, unit, kReal, scale, lower, upper, nominal, summary, {}, ""};
}

Parameter integer(const char* key, const char* unit, double lower, double upper, double nominal,
                  const char* summary, ParameterScale scale = kLinear) {
  return {key, unit, kInteger, scale, lower, upper, nominal, summary, {}, ""};
}

Parameter boolean(const char* key, bool nominal, const char* summary) {
  return {key, "-", kBoolean, kLinear, 0, 1, nominal ? 1.0 : 0.0, summary, {}, ""};
}

// In the order of enum Racquetball.
std::vector<Parameter> rows() {
  return {
      real("gravity", "m/s^2", 1, 30, 9.81, "downward"),
      integer("step_rate", "Hz", 30, 2000, 240, "physics steps a second", kLog),
      integer("sub_steps", "-", 1, 10, 1, "physics steps within each of those"),
      integer("solver_iterations", "-", 1, 100, 10, "of the contact solver"),
      real("ball_radius", "m", 0.2, 2, 0.75, "of the ball"),
      real("ball_mass", "kg", 0.05, 20, 1, "of the ball", kLog),
      real("inertia_factor", "-", 0.2, 3, 1, "of a solid sphere's moment of inertia"),
      real("ball_restitution", "-", 0, 1, 0.85, "of the ball"),
      real("ball_friction", "-", 0, 2, 0.5, "of the ball"),
      real("rolling_friction", "m", 0, 0.2, 0, "torque against rolling over normal force"),
      real("anisotropic_friction", "-", 0, 1, 1, "share of the friction along the ball's own y"),
      real("wall_restitution", "-", 0, 1, 1, "of walls, floor, ceiling and paddle"),
      real("wall_friction", "-", 0, 2, 0.5, "of walls, floor, ceiling and paddle"),
      real("linear_damping", "-", 0, 1, 0.04, "share of velocity lost a second"),
      real("angular_damping", "-", 0, 1, 0.1, "share of spin lost a second"),
      real("maximum_velocity", "m/s", 1, 200, 200, "faster than that the ball never gets", kLog),
      {"collision_shape",
       "-",
       kChoice,
       kLinear,
       0,
       2,
       0,
       "of the ball",
       {"sphere", "box", "hull"},
       ""},
      boolean("contact_response", true, "bodies push one another"),
      boolean("continuous", false, "continuous collision detection of the ball"),
      real("error_reduction", "-", 0.05, 0.9, 0.2, "share of a penetration repaired a step"),
      boolean("sleeping", true, "slow bodies fall asleep"),
      real("sleep_linear", "m/s", 0, 10, 0.8, "speed below which the ball may fall asleep"),
      real("sleep_angular", "rad/s", 0, 10, 1, "spin below which the ball may fall asleep"),
      real("launch_speed", "m/s", 5, 40, 20, "of the ball at the start, along x"),
      real("launch_side", "m/s", -5, 5, 0.35, "of the ball at the start, along y"),
      real("launch_lift", "m/s", -5, 5, 0, "of the ball at the start, upward"),
      real("launch_spin", "rad/s", -50, 50, 0, "of the ball at the start, about x"),
      real("launch_force", "N", -50, 50, 0, "on the ball for the first tenth of a second, along x"),
      real("paddle_speed", "m/s", 0, 30, 5, "toward the ball when the paddle strikes"),
      real("paddle_tilt", "rad", -0.6, 0.6, 0.25, "of the paddle, upward"),
      real("paddle_size", "m", 0.5, 6, 3, "width and height of the paddle"),
      real("paddle_spin", "rad/s", -50, 50, 0, "given to the ball by a strike, about x"),
      real("start_noise", "m", 0, 0.1, 0.001, "s.d. of each start coordinate of a noisy run"),
      real("launch_noise", "m/s", 0, 1, 0.01, "s.d. of each launch velocity of a noisy run"),
  };
}

}  // namespace

const ParameterTable& racquetball_table() {
  static const ParameterTable table = [] {
    std::vector<Parameter> all = rows();
    assert(all.size() == row_of(Racquetball::kCount));
    return ParameterTable(std::move(all), {});
  }();
  return table;
}

}  // namespace gapfarm
