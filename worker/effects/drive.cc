// Effects on what the motors do.
#include <algorithm>
#include <array>
#include <cmath>

#include "worker/effects/behaviour.h"

namespace gapfarm {
namespace {

double beyond_band(double duty, double band) {
  return std::abs(duty) <= band ? 0 : std::copysign(std::abs(duty) - band, duty);
}

// A side has no direction to differ from before its first command in the session, nor after an
// unrecorded move: a hand that puts the robot down elsewhere turns its treads.
void take_up(double travel, int last, SideState& side) {
  if (last != 0 && side.duty * last < 0) side.dead_travel_m += travel;
}

enum Slip : std::size_t { kProbability, kLoss };

struct SideCase {
  double weight;
  double gain;
};

// One side: nothing happens, or a loss uniform in [0, loss], by three-point Gauss-Legendre nodes.
std::array<SideCase, 4> side_cases(EffectValues p) {
  const double offset = std::sqrt(0.6) / 2;
  return {{{1 - p[kProbability], 1},
           {p[kProbability] * 5 / 18, 1 - p[kLoss] * (0.5 - offset)},
           {p[kProbability] * 8 / 18, 1 - p[kLoss] * 0.5},
           {p[kProbability] * 5 / 18, 1 - p[kLoss] * (0.5 + offset)}}};
}

// Either parameter alone does nothing.
bool never_slips(EffectValues p) { return p[kProbability] == 0 || p[kLoss] == 0; }

// Both sides slipping in one trial is kept: at large probabilities it is not rare.
std::vector<DriveBranch> slips(EffectValues p) {
  if (never_slips(p)) return {DriveBranch{}};
  std::vector<DriveBranch> all;
  for (const SideCase& left : side_cases(p)) {
    for (const SideCase& right : side_cases(p)) {
      all.push_back({left.weight * right.weight, left.gain, right.gain});
    }
  }
  return all;
}

DriveBranch draw_slip(EffectValues p, Stream& stream) {
  DriveBranch branch;
  if (never_slips(p)) return branch;
  if (stream.bernoulli(p[kProbability])) branch.left_gain = 1 - p[kLoss] * stream.uniform();
  if (stream.bernoulli(p[kProbability])) branch.right_gain = 1 - p[kLoss] * stream.uniform();
  return branch;
}

constexpr EffectBehaviour kDriveEffects[] = {
    {.name = "motor_asymmetry",
     // Split evenly, so that the mean speed stays the base's: right over left is 1 + ratio.
     .drive =
         [](EffectValues p, const Situation&, DriveState& drive) {
           const double left = 1 / (1 + p[0] / 2);
           drive.left.gain *= left;
           drive.right.gain *= left * (1 + p[0]);
         }},
    {.name = "motor_deadband",
     .drive =
         [](EffectValues p, const Situation&, DriveState& drive) {
           drive.left.duty = beyond_band(drive.left.duty, p[0]);
           drive.right.duty = beyond_band(drive.right.duty, p[0]);
         }},
    {.name = "motor_lag",
     .drive =
         [](EffectValues p, const Situation&, DriveState& drive) {
           drive.left.lag_s += p[0];
           drive.right.lag_s += p[0];
         }},
    {.name = "timing_offset",
     .drive = [](EffectValues p, const Situation&,
                 DriveState& drive) { drive.duration_s = std::max(0.0, drive.duration_s + p[0]); }},
    {.name = "battery_sag",
     .drive =
         [](EffectValues p, const Situation& situation, DriveState& drive) {
           const double left_over = std::max(0.0, 1 - p[0] * situation.session_time_s / 60);
           drive.left.gain *= left_over;
           drive.right.gain *= left_over;
         }},
    {.name = "backlash",
     .drive =
         [](EffectValues p, const Situation& situation, DriveState& drive) {
           take_up(p[0], situation.last_left, drive.left);
           take_up(p[0], situation.last_right, drive.right);
         }},
    {.name = "slip_events", .branches = slips, .draw = draw_slip},
    {.name = "session_gain", .session_spread = [](EffectValues p) { return p[0]; }},
};

}  // namespace

std::span<const EffectBehaviour> drive_effects() { return kDriveEffects; }

}  // namespace gapfarm
