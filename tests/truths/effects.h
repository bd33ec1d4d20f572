// The effects of the catalogue, and some that it does not hold, for simulators that are not the
// worker's: written from docs/effects.md, with parameters of the same names and units.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/random/stream.h"
#include "tests/truths/engine.h"

namespace gapfarm::truths {

using Values = std::map<std::string, double>;

// What a drive is reported, beyond the scene.
struct Commanded {
  double t_s = 0;  // since the session began
  std::size_t session = 0;
  bool moved = false;                    // by hand, before the trial
  double last_left = 0, last_right = 0;  // duties of the trial before in its session
};

struct SideCommand {
  double duty = 0;
  double gain = 1;
  double dead_travel_m = 0;
};

struct CommandedMotion {
  SideCommand left, right;
  double on_s = 0;
  double lag_s = 0;
};

struct Readings {
  double stale_share = 0, stale_age_s = 0;
  double unsettled_share = 0, unsettled_angle_rad = 0;
  double grid_m = 0;
};

// One effect; what it does not touch is null.
struct EffectRow {
  std::string name;
  bool in_catalogue = true;
  // Its parameters at a strength in (0, 1] on a robot whose arena is `arena_m` wide; whatever else
  // there is to draw is drawn alike at every strength.
  Values (*draw)(double strength, double arena_m, Stream stream) = nullptr;
  void (*scene)(const Values&, Scene&) = nullptr;
  void (*drive)(const Values&, const Commanded&, Stream&, CommandedMotion&) = nullptr;
  void (*see)(const Values&, Pose&) = nullptr;  // true to logged pose
  void (*read)(const Values&, Readings&) = nullptr;
};

std::span<const EffectRow> effect_rows();
// REQUIRES: there is one of the name.
const EffectRow& effect_row(const std::string& name);

struct Cause {
  const EffectRow* row = nullptr;
  Values values;
};

}  // namespace gapfarm::truths
