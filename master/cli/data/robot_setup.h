// A robot out of the files that its user has, and the config that fits it to its runs: what
// `gapfarm robot --config` writes, and `gapfarm init URDF` as its front.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"
#include "master/io/robot_files/understand.h"

namespace gapfarm {

struct RobotSetup {
  std::vector<std::string> files,
      controllers;                // URDFs and robot.tomls; .yaml of either is a controller's
  std::string robot;              // robot.toml to write; empty: none
  std::string config;             // to write; empty: none; "-": text alone
  std::vector<std::string> runs;  // folders that the config names
};

struct RobotTexts {
  RobotReading reading;
  GroundRobot completed;
  std::string robot, config;
};

// Reads the files and makes the texts.
Result<RobotTexts> set_up_robot(const RobotSetup& setup, Outputs& outputs);
// Both files, planned before.
Status write_robot(const RobotSetup& setup, const RobotTexts& texts, const Outputs& outputs);

// `file` as a config at `out` ("-": in the working folder) names it.
std::string file_seen_from(const std::string& out, const std::string& file);

// Whether the words of the command line name a robot rather than a trial log.
bool names_a_robot(const std::vector<std::string>& arguments);

// gapfarm init URDF...: `words` are the robot's files and, after them or between, folders of runs.
// Leaves `out` and beside it the robot.toml that it names; "-" shows the config alone.
Result<int> run_init_robot(const std::vector<std::string>& arguments, const std::string& out,
                           Outputs& outputs, CliContext& context);

// Says where a config went and what it is of; for `out` "-" shows its text.
void show_config(const std::string& out, const std::string& of, const std::string& text, Json json,
                 Console& console);

}  // namespace gapfarm
