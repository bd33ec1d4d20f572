// What gapfarm export is asked for.
#pragma once

#include "master/cli/subcommand.h"
#include "master/command/outputs.h"

namespace gapfarm {

struct ExportCommand : LongOptions {
  std::string format;
  std::string source;
  std::string controllers;
  std::string urdf;
  int samples = 0;
  std::uint64_t seed = 1;
  std::vector<std::string> runs;
};

// Simulated beside measured runs, for Foxglove and PlotJuggler.
Result<int> export_runs(ExportCommand& command, CliContext& context);

}  // namespace gapfarm
