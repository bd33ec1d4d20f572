// gapfarm robot FILE...: what a robot is, from the files that its user has.
#include <filesystem>
#include <memory>

#include "master/cli/data/robot_setup.h"
#include "master/cli/subcommand.h"
#include "master/io/robot_files/understand.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

struct RobotOptions {
  RobotSetup setup;
  std::string picture;
  Outputs outputs;
};

// Names come from files: they may not steer the terminal.
std::string plain_lines(const std::string& text) {
  return joined(lines_of(text), "", [](std::string_view line) { return printable(line) + "\n"; });
}

std::string next_steps_of(const RobotSetup& setup) {
  if (setup.config.empty()) return "gapfarm import runs LOG --out drive";
  return "gapfarm import runs LOG --out " + (setup.runs.empty() ? "drive" : setup.runs[0]) +
         ", then: gapfarm evolve " + setup.config + " --out run/" +
         fs::path(setup.config).stem().string();
}

Result<int> run_robot(RobotOptions& options, CliContext& context) {
  Console& console = context.console;
  const RobotSetup& setup = options.setup;
  ASSIGN_OR_RETURN(const RobotTexts texts, set_up_robot(setup, options.outputs));
  RETURN_IF_ERROR(options.outputs.plan({setup.robot, setup.config, options.picture}));
  context.begun = true;
  RETURN_IF_ERROR(write_robot(setup, texts, options.outputs));
  if (!options.picture.empty()) {
    RETURN_IF_ERROR(
        options.outputs.write(options.picture, draw_robot(texts.reading, texts.completed)));
  }
  if (console.json()) {
    console.print(describe_robot_json(texts.reading, texts.completed, texts.robot));
    return kExitDone;
  }
  console.print(plain_lines(describe_robot(texts.reading, texts.completed)));
  if (setup.robot.empty()) {
    console.print("\nrobot.toml, to paste and correct (--out robot.toml writes it):\n\n" +
                  plain_lines(texts.robot));
  } else {
    console.note("robot written to " + setup.robot + "; next: " + next_steps_of(setup));
  }
  return kExitDone;
}

}  // namespace

SubcommandRun setup_robot(CLI::App& app) {
  auto options = std::make_shared<RobotOptions>();
  app.add_option("FILE", options->setup.files,
                 "URDF, controller YAML or robot.toml; further ones are held against the first")
      ->required();
  app.add_option("--controllers", options->setup.controllers,
                 "Controller files (ros_control, ros2_control)");
  app.add_option("-o,--out", options->setup.robot, "Write the robot as TOML");
  app.add_option("--picture", options->picture, "Draw the robot from above (SVG)");
  app.add_option("--config", options->setup.config,
                 "Write a config that fits the robot to its runs")
      ->needs("--out");
  app.add_option("--runs", options->setup.runs, "Folders of runs that the config names (drive)");
  options->outputs.declare(app);
  app.footer(
      "Examples:\n"
      "  gapfarm robot husky.urdf --controllers control.yaml --out robot.toml\n"
      "  gapfarm robot burger.urdf --picture burger.svg\n"
      "  gapfarm robot old.urdf new.urdf\n"
      "  gapfarm robot husky.urdf --controllers control.yaml --out robot.toml --config husky.toml\n"
      "gapfarm init URDF [YAML] [RUNS] --out CONFIG writes the same two files in one go.\n"
      "Next: gapfarm import runs drive.bag --out drive, then gapfarm evolve husky.toml --out "
      "run/husky");
  return [options](CliContext& context) { return run_robot(*options, context); };
}

}  // namespace gapfarm
