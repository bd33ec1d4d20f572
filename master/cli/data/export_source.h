// What gapfarm export is asked for and reads, and its tools.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/cli/subcommand.h"
#include "master/command/inputs.h"
#include "master/command/long_command.h"
#include "master/command/outputs.h"
#include "master/ground/fit/window_fit.h"
#include "master/ground/report/ros_export.h"

namespace gapfarm {

inline constexpr int kMostSamplesOut = 9999;

struct ExportCommand : LongOptions {
  std::string format;
  std::string source;
  std::string controllers;
  std::string urdf;
  int samples = 0;
  std::uint64_t seed = 1;
  std::vector<std::string> runs;
  std::string out;
};

// A ground robot and the log that it is fitted to.
struct GroundSource {
  GroundRobot robot;
  std::vector<std::string> logs;  // folders
  RosFriction friction;           // as simulated, of a run that searched for it
};

// Of a config or a run.  Errors: it is neither, or not of a ground robot.
Result<GroundSource> read_ground_source(const std::string& source, Console& console);
// Every value of the robot's kinematics by its log.
Result<GroundReference> fit_source(const GroundSource& source, Console& console);
// By values.json of a ground robot's diagnosis, where there is one.
Result<std::optional<ReportedValues>> values_in(const std::string& folder);

Result<int> export_ranges(ExportCommand& command, CliContext& context);
Result<int> export_runs(ExportCommand& command, CliContext& context);

}  // namespace gapfarm
