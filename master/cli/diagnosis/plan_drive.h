// gapfarm plan: what its parts share.
#pragma once

#include "master/command/outputs.h"
#include "master/experiments/plan/design.h"
#include "master/experiments/plan/drive_knowledge.h"

namespace gapfarm {

struct PlanOptions : LongOptions {
  std::string source;
  std::string picture;
  std::string place;
  plan::PlanSettings settings;
  std::optional<unsigned> sessions, chain;
  std::vector<double> levels, durations;
  // Of a ground robot.
  plan::DriveSettings drive;
  std::vector<std::string> wanted;  // NAME or NAME=WIDTH
  std::vector<std::string> limits;  // CHANNEL=MOST or CHANNEL=LEAST,MOST
};

// A drive that shows the values of a ground robot's kinematics: writes commands.csv and
// waypoints.csv.  REQUIRES: `config` has a ground robot, the outputs know what is read.
Result<int> run_plan_drive(PlanOptions& options, const Config& config, CliContext& context);

}  // namespace gapfarm
