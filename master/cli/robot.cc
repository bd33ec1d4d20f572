// gapfarm robot FILE...: what a robot is, from the files that its user has.
#include <filesystem>
#include <memory>

#include "common/robot/robot_file.h"
#include "master/cli/outputs.h"
#include "master/cli/robot_files.h"
#include "master/cli/subcommand.h"
#include "master/robot/robot_config.h"
#include "master/robot/robot_text.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

struct RobotOptions {
  std::vector<std::string> files;
  std::vector<std::string> controllers;
  std::string out;
  std::string picture;
  std::string config;
  std::string runs = "drive";
  Outputs outputs;
};

// Names come from files: they may not steer the terminal.
std::string plain_lines(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    out += printable(std::string_view(text).substr(at, end - at)) + "\n";
    at = end + 1;
  }
  return out;
}

// The robot's file as a config beside it names it.
std::string beside(const std::string& file, const std::string& config) {
  if (file.empty() || config.empty()) return file;
  std::error_code code;
  const fs::path from = fs::absolute(config, code).parent_path();
  const fs::path way = fs::absolute(file, code).lexically_relative(from);
  return way.empty() ? file : way.string();
}

Status plan_outputs(RobotOptions& options) {
  for (const auto* files : {&options.files, &options.controllers}) {
    for (const std::string& file : *files) options.outputs.reads(file);
  }
  return options.outputs.plan(
      std::vector<std::string>{options.out, options.picture, options.config});
}

int run_robot(RobotOptions& options, CliContext& context) {
  Console& console = context.console;
  Result<RobotReading> reading = read_robot_files(options.files, options.controllers);
  if (reading) {
    if (Status s = plan_outputs(options); !s) reading = s.error();
  }
  if (!reading) {
    console.error(reading.error());
    return kExitBadUsage;
  }
  GroundRobot completed = reading->robot;
  if (const Status status = complete_robot(&completed); !status) {
    console.error(Error{options.files[0] + ": " + status.error().message +
                        "; state it in a robot.toml (docs/formats.md)"});
    return kExitBadUsage;
  }
  const std::string toml = format_robot(completed);
  const std::pair<const std::string*, std::string> outputs[] = {
      {&options.out, toml},
      {&options.config,
       config_of_robot(completed, beside(options.out, options.config), options.runs)},
      {&options.picture, options.picture.empty() ? "" : draw_robot(*reading, completed)}};
  for (const auto& [path, text] : outputs) {
    if (path->empty()) continue;
    if (const Status status = options.outputs.write(*path, text); !status) {
      console.error(status.error());
      return kExitFailed;
    }
  }
  if (console.json()) {
    console.print(describe_robot_json(*reading, completed, toml));
    return kExitDone;
  }
  console.print(plain_lines(describe_robot(*reading, completed)));
  if (options.out.empty()) {
    console.print("\nrobot.toml, to paste and correct (--out robot.toml writes it):\n\n" +
                  plain_lines(toml));
  } else {
    console.note("robot written to " + options.out + "; next: gapfarm import runs LOG --out " +
                 (options.config.empty()
                      ? "drive"
                      : options.runs + ", then: gapfarm evolve " + options.config + " --out run/" +
                            fs::path(options.config).stem().string()));
  }
  return kExitDone;
}

}  // namespace

SubcommandRun setup_robot(CLI::App& app) {
  auto options = std::make_shared<RobotOptions>();
  app.add_option("FILE", options->files,
                 "URDF, controller YAML or robot.toml; further ones are held against the first")
      ->required();
  app.add_option("--controllers", options->controllers,
                 "Controller files (ros_control, ros2_control)");
  app.add_option("-o,--out", options->out, "Write the robot as TOML");
  app.add_option("--picture", options->picture, "Draw the robot from above (SVG)");
  app.add_option("--config", options->config, "Write a config that fits the robot to its logs")
      ->needs("--out");
  app.add_option("--runs", options->runs, "Folder of the logs that the config names")
      ->capture_default_str();
  options->outputs.declare(app);
  app.footer(
      "Examples:\n"
      "  gapfarm robot husky.urdf --controllers control.yaml --out robot.toml\n"
      "  gapfarm robot burger.urdf --picture burger.svg\n"
      "  gapfarm robot old.urdf new.urdf\n"
      "  gapfarm robot husky.urdf --controllers control.yaml --out robot.toml --config husky.toml\n"
      "Next: gapfarm import runs drive.bag --out drive, then gapfarm evolve husky.toml --out "
      "run/husky");
  return [options](CliContext& context) { return run_robot(*options, context); };
}

}  // namespace gapfarm
