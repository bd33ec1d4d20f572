// gapfarm plan of a ground robot: a drive that shows the values of its kinematics.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "common/config/settings.h"
#include "master/command/console.h"
#include "master/command/outputs.h"
#include "master/experiments/plan/drive_knowledge.h"

namespace gapfarm {

struct DriveOptions {
  plan::DriveSettings settings;
  std::vector<std::string> wanted;  // NAME or NAME=WIDTH
  std::vector<std::string> limits;  // CHANNEL=MOST or CHANNEL=LEAST,MOST

  void declare(CLI::App& app);
};

struct DriveTask {
  std::string source;  // of the config
  std::string out;     // folder
  std::string picture;
};

// Writes commands.csv and waypoints.csv.  REQUIRES: `config` has a ground robot, `outputs` knows
// what is read.
Result<int> run_plan_drive(const DriveOptions& options, const DriveTask& task, const Config& config,
                           Outputs& outputs, CliContext& context);

}  // namespace gapfarm
