// What an effect does to the scenario's commands, as a picture.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/effects/catalogue.h"
#include "common/pose/pose.h"

namespace gapfarm {

// One drive as the log has it.
struct LoggedDrive {
  std::vector<Pose> path;
  Pose end;
};

// One command, with and without the effect; poses in the frame of the logged start.
struct EffectDrives {
  std::string command;
  LoggedDrive without;
  std::vector<LoggedDrive> with;  // more than one where chance has a say
};

// An SVG with a panel a command: the drive without the effect dashed with a hollow end, with it
// solid with a filled one, each with a stroke along its heading, and by how much the end differs.
// The drives are seen from X_WS, heading along the world's x.  Directions, discs, lines and centres
// among the effect's `values` (in the catalogue's order) are drawn too, recognised by their
// parameters' names: direction; x, y and radius; position and axis; x, y.
std::string effect_figure(const Effect& effect, std::span<const double> values, const Pose& X_WS,
                          std::span<const EffectDrives> drives);

}  // namespace gapfarm
