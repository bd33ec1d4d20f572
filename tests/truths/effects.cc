#include "tests/truths/effects.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gapfarm::truths {
namespace {

constexpr double kPi = std::numbers::pi;

double sign(Stream& stream) { return stream.bernoulli(0.5) ? 1 : -1; }
double direction(Stream& stream) { return stream.uniform(-kPi, kPi); }
double place(double arena_m, Stream& stream) { return arena_m * stream.uniform(0.25, 0.75); }

// A strength alone, of either sign where `either`.
template <const char* key, double most, bool either>
Values alone(double strength, double, Stream stream) {
  return {{key, strength * most * (either ? sign(stream) : 1)}};
}

// A strength and a direction in the world.
template <const char* key, double most>
Values directed(double strength, double, Stream stream) {
  return {{key, strength * most}, {"direction", direction(stream)}};
}

// Two strengths, along a direction on the robot.
template <double most>
Values offset(double strength, double, Stream stream) {
  const double angle = direction(stream);
  return {{"x", strength * most * std::cos(angle)}, {"y", strength * most * std::sin(angle)}};
}

Values draw_patch(double strength, double arena_m, Stream stream) {
  const double most = sign(stream) > 0 ? std::log(3.0) : std::log(0.08);
  return {{"ratio", std::exp(strength * most)},
          {"x", place(arena_m, stream)},
          {"y", place(arena_m, stream)},
          {"radius", arena_m * stream.uniform(0.1, 0.2)}};
}

Values draw_slips(double strength, double, Stream stream) {
  return {{"probability", 0.5 * strength}, {"loss", stream.uniform(0.4, 0.9)}};
}

Values draw_aspect(double strength, double, Stream stream) {
  return {{"ratio", std::exp(strength * std::log(1.5) * sign(stream))}};
}

Values draw_lens(double strength, double arena_m, Stream stream) {
  return {{"k1", 0.3 * strength * sign(stream)},
          {"x", place(arena_m, stream)},
          {"y", place(arena_m, stream)}};
}

Values draw_seam(double strength, double arena_m, Stream stream) {
  const double angle = direction(stream), tilt = direction(stream);
  return {{"axis", stream.bernoulli(0.5) ? 1 : 0},
          {"position", place(arena_m, stream)},
          {"offset_x", 0.3 * strength * std::cos(angle)},
          {"offset_y", 0.3 * strength * std::sin(angle)},
          {"slope_x", 0.1 * strength * std::cos(tilt)},
          {"slope_y", 0.1 * strength * std::sin(tilt)}};
}

Values draw_latency(double strength, double, Stream stream) {
  return {{"share", strength}, {"latency", stream.uniform(0.1, 0.4)}};
}

Values draw_unsettled(double strength, double, Stream stream) {
  return {{"share", strength}, {"angle", stream.uniform(0.3, 1.2)}};
}

Values draw_compass(double strength, double, Stream stream) {
  return {{"amplitude", 0.5 * strength}, {"phase", direction(stream)}};
}

void asymmetry(const Values& p, const Commanded&, Stream&, CommandedMotion& drive) {
  const double ratio = p.at("ratio");
  drive.left.gain *= 2 / (2 + ratio);
  drive.right.gain *= 2 * (1 + ratio) / (2 + ratio);
}

void dead_band(const Values& p, const Commanded&, Stream&, CommandedMotion& drive) {
  for (SideCommand* side : {&drive.left, &drive.right}) {
    const double beyond = std::max(0.0, std::abs(side->duty) - p.at("duty"));
    side->duty = std::copysign(beyond, side->duty);
  }
}

void lag(const Values& p, const Commanded&, Stream&, CommandedMotion& drive) {
  drive.lag_s += p.at("tau");
}

void timing(const Values& p, const Commanded&, Stream&, CommandedMotion& drive) {
  drive.on_s = std::max(0.0, drive.on_s + p.at("offset"));
}

void sag(const Values& p, const Commanded& commanded, Stream&, CommandedMotion& drive) {
  const double left_over = std::max(0.0, 1 - p.at("rate") * commanded.t_s / 60);
  drive.left.gain *= left_over;
  drive.right.gain *= left_over;
}

void backlash(const Values& p, const Commanded& commanded, Stream&, CommandedMotion& drive) {
  if (commanded.moved) return;
  if (commanded.last_left * drive.left.duty < 0) drive.left.dead_travel_m += p.at("travel");
  if (commanded.last_right * drive.right.duty < 0) drive.right.dead_travel_m += p.at("travel");
}

void slips(const Values& p, const Commanded&, Stream& stream, CommandedMotion& drive) {
  for (SideCommand* side : {&drive.left, &drive.right}) {
    const double chance = stream.uniform(), share = stream.uniform();
    if (chance < p.at("probability")) side->gain *= 1 - p.at("loss") * share;
  }
}

void tilt(const Values& p, Scene& scene) {
  scene.floor.tilt_rad = p.at("angle");
  scene.floor.tilt_direction_rad = p.at("direction");
}

void nap(const Values& p, Scene& scene) {
  scene.floor.nap_strength = p.at("strength");
  scene.floor.nap_direction_rad = p.at("direction");
}

void patch(const Values& p, Scene& scene) {
  scene.floor.patch_ratio = p.at("ratio");
  scene.floor.patch_x_m = p.at("x");
  scene.floor.patch_y_m = p.at("y");
  scene.floor.patch_radius_m = p.at("radius");
}

void resistance(const Values& p, Scene& scene) {
  scene.floor.rolling_resistance = p.at("coefficient");
}

void com(const Values& p, Scene& scene) {
  scene.com_x_m = p.at("x");
  scene.com_y_m = p.at("y");
}

void aspect(const Values& p, Pose& X) {
  const double root = std::sqrt(p.at("ratio"));
  X.x /= root;
  X.y *= root;
}

void lens(const Values& p, Pose& X) {
  const double dx = X.x - p.at("x"), dy = X.y - p.at("y");
  const double more = p.at("k1") * (dx * dx + dy * dy);
  X.x += more * dx;
  X.y += more * dy;
}

void seam(const Values& p, Pose& X) {
  const bool across_x = p.at("axis") == 0;
  const double across = across_x ? X.x : X.y, along = across_x ? X.y : X.x;
  if (across <= p.at("position")) return;
  X.x += p.at("offset_x") + p.at("slope_x") * along;
  X.y += p.at("offset_y") + p.at("slope_y") * along;
}

void heading(const Values& p, Pose& X) { X.theta = wrap_angle(X.theta + p.at("angle")); }
void marker(const Values& p, Pose& X) { X = X * Pose{p.at("x"), p.at("y"), 0}; }

void latency(const Values& p, Readings& readings) {
  readings.stale_share = p.at("share");
  readings.stale_age_s = p.at("latency");
}

void unsettled(const Values& p, Readings& readings) {
  readings.unsettled_share = p.at("share");
  readings.unsettled_angle_rad = p.at("angle");
}

void rounding(const Values& p, Readings& readings) { readings.grid_m = p.at("step"); }

// Speed grows with a power of the duty.
void bent_duty(const Values& p, const Commanded&, Stream&, CommandedMotion& drive) {
  for (SideCommand* side : {&drive.left, &drive.right}) {
    side->duty = std::copysign(std::pow(std::abs(side->duty), 1 + p.at("bend")), side->duty);
  }
}

// A side goes faster after it was driven hard.
void memory(const Values& p, const Commanded& commanded, Stream&, CommandedMotion& drive) {
  drive.left.gain *= 1 + p.at("share") * std::abs(commanded.last_left);
  drive.right.gain *= 1 + p.at("share") * std::abs(commanded.last_right);
}

// Charged fully, half, and not at all.
void session_gain(const Values& p, const Commanded& commanded, Stream&, CommandedMotion& drive) {
  constexpr double kDeviations[] = {1, 0.1, -1.1};
  const double gain = 1 + p.at("spread") * kDeviations[commanded.session % std::size(kDeviations)];
  drive.left.gain *= gain;
  drive.right.gain *= gain;
}

// A share of the left duty leaks into the right one.
void crosstalk(const Values& p, const Commanded&, Stream&, CommandedMotion& drive) {
  drive.right.duty += p.at("share") * drive.left.duty;
}

void reverse_loss(const Values& p, const Commanded&, Stream&, CommandedMotion& drive) {
  for (SideCommand* side : {&drive.left, &drive.right}) {
    if (side->duty < 0) side->gain *= 1 - p.at("share");
  }
}

void compass(const Values& p, Pose& X) {
  X.theta = wrap_angle(X.theta + p.at("amplitude") * std::sin(X.theta - p.at("phase")));
}

void shear(const Values& p, Pose& X) { X.x += p.at("share") * X.y; }

constexpr char kRatio[] = "ratio", kDuty[] = "duty", kTau[] = "tau", kOffset[] = "offset",
               kRate[] = "rate", kTravel[] = "travel", kAngle[] = "angle", kStrength[] = "strength",
               kCoefficient[] = "coefficient", kStep[] = "step", kBend[] = "bend",
               kShare[] = "share", kSpread[] = "spread";

const std::vector<EffectRow>& rows() {
  static const std::vector<EffectRow> all = {
      {.name = "motor_asymmetry", .draw = alone<kRatio, 0.3, true>, .drive = asymmetry},
      {.name = "motor_deadband", .draw = alone<kDuty, 0.12, false>, .drive = dead_band},
      {.name = "motor_lag", .draw = alone<kTau, 0.5, false>, .drive = lag},
      {.name = "timing_offset", .draw = alone<kOffset, 0.2, true>, .drive = timing},
      {.name = "battery_sag", .draw = alone<kRate, 0.05, false>, .drive = sag},
      {.name = "backlash", .draw = alone<kTravel, 0.05, false>, .drive = backlash},
      {.name = "slip_events", .draw = draw_slips, .drive = slips},
      {.name = "floor_tilt", .draw = directed<kAngle, 0.3>, .scene = tilt},
      {.name = "floor_nap", .draw = directed<kStrength, 1.0>, .scene = nap},
      {.name = "friction_patch", .draw = draw_patch, .scene = patch},
      {.name = "rolling_resistance", .draw = alone<kCoefficient, 1.0, false>, .scene = resistance},
      {.name = "com_offset", .draw = offset<0.03>, .scene = com},
      {.name = "marker_offset", .draw = offset<0.05>, .see = marker},
      {.name = "camera_aspect", .draw = draw_aspect, .see = aspect},
      {.name = "camera_distortion", .draw = draw_lens, .see = lens},
      {.name = "camera_seam", .draw = draw_seam, .see = seam},
      {.name = "heading_offset", .draw = alone<kAngle, 0.5, true>, .see = heading},
      {.name = "pose_latency", .draw = draw_latency, .read = latency},
      {.name = "pose_quantisation", .draw = alone<kStep, 0.1, false>, .read = rounding},
      {.name = "unsettled_start", .draw = draw_unsettled, .read = unsettled},
      {.name = "session_gain", .draw = alone<kSpread, 0.3, false>, .drive = session_gain},
      {.name = "bent_duty",
       .in_catalogue = false,
       .draw = alone<kBend, 1.0, true>,
       .drive = bent_duty},
      {.name = "duty_memory",
       .in_catalogue = false,
       .draw = alone<kShare, 0.5, true>,
       .drive = memory},
      {.name = "crosstalk",
       .in_catalogue = false,
       .draw = alone<kShare, 0.3, true>,
       .drive = crosstalk},
      {.name = "reverse_loss",
       .in_catalogue = false,
       .draw = alone<kShare, 0.5, false>,
       .drive = reverse_loss},
      {.name = "bent_compass", .in_catalogue = false, .draw = draw_compass, .see = compass},
      {.name = "camera_shear",
       .in_catalogue = false,
       .draw = alone<kShare, 0.4, true>,
       .see = shear}};
  return all;
}

}  // namespace

std::span<const EffectRow> effect_rows() { return rows(); }

const EffectRow& effect_row(const std::string& name) {
  return *std::find_if(rows().begin(), rows().end(),
                       [&](const EffectRow& row) { return row.name == name; });
}

}  // namespace gapfarm::truths
