// gapfarm robot FILE...: what a robot is, from the files that its user has.
#include "common/robot/robot.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/trials/files.h"
#include "master/cli/data/robot_setup.h"
#include "master/io/robot_files/controllers.h"
#include "master/io/robot_files/understand.h"
#include "master/report/figures/figures.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

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

struct RobotOptions {
  RobotSetup setup;
  std::string picture;
  Outputs outputs;
};

bool ends_with(const std::string& file, std::initializer_list<std::string_view> endings) {
  return contains(endings, fs::path(file).extension().string());
}

// A robot.toml says everything itself.
Result<RobotReading> read_toml(const std::string& file) {
  ASSIGN_OR_RETURN(GroundRobot robot, read_robot(file));
  RobotReading reading;
  reading.robot = std::move(robot);
  reading.sources.resize(reading.robot.wheels.size());
  reading.evidence.push_back(file + " says so");
  return reading;
}

Result<RobotReading> read_urdf(const std::string& file, const std::vector<DriveFacts>& facts) {
  ASSIGN_OR_RETURN(const UrdfModel model, parse_file(file, parse_urdf));
  return understand_robot(model, facts);
}

Result<std::vector<DriveFacts>> read_controllers(const std::vector<std::string>& files) {
  std::vector<DriveFacts> facts;
  for (const std::string& file : files) {
    ASSIGN_OR_RETURN(const ControllerFile read, parse_file(file, parse_controllers));
    append(facts, read.drives);
  }
  return facts;
}

// Where the robot goes: husky.toml has its robot in husky_robot.toml.
std::string robot_beside(const std::string& out) {
  if (out == "-") return "robot.toml";
  const fs::path path(out);
  return (path.parent_path() / (path.stem().string() + "_robot.toml")).string();
}

// A robot out of the files that its user has: URDFs, robot.tomls, and controller files among them
// (.yaml, .yml) or in `controllers`: the first robot; what others say differently is added to its
// disagreements.  Errors name the file.
Result<RobotReading> read_robot_files(const std::vector<std::string>& files,
                                      std::vector<std::string> controllers) {
  std::vector<std::string> robots;
  for (const std::string& file : files) {
    (ends_with(file, {".yaml", ".yml"}) ? controllers : robots).push_back(file);
  }
  ASSIGN_OR_RETURN(const std::vector<DriveFacts> facts, read_controllers(controllers));
  if (robots.empty()) return understand_controllers(facts);
  std::optional<RobotReading> first;
  for (const std::string& file : robots) {
    ASSIGN_OR_RETURN(RobotReading next,
                     ends_with(file, {".toml"}) ? read_toml(file) : read_urdf(file, facts));
    if (!first) {
      first = std::move(next);
      continue;
    }
    append(first->disagreements, compare_readings(*first, robots[0], next, file));
  }
  return *std::move(first);
}

RobotSetup setup_of_arguments(const std::vector<std::string>& arguments, const std::string& out) {
  RobotSetup setup;
  for (const std::string& word : arguments) {
    (is_folder(word) ? setup.runs : setup.files).push_back(word);
  }
  setup.robot = robot_beside(out);
  setup.config = out;
  return setup;
}

// Reads the files and makes the texts.
Result<RobotTexts> set_up_robot(const RobotSetup& setup, Outputs& outputs) {
  ASSIGN_OR_RETURN(RobotReading reading, read_robot_files(setup.files, setup.controllers));
  RobotTexts texts;
  texts.completed = reading.robot;
  if (const Status s = complete_robot(&texts.completed); !s) {
    return Error{setup.files[0] + ": " + s.error().message +
                 "; a robot.toml (docs/formats.md) can state it"};
  }
  for (const auto* files : {&setup.files, &setup.controllers}) {
    for (const std::string& file : *files) outputs.reads(file);
  }
  outputs.reads_runs(setup.runs);
  RobotConfigTexts config_texts;
  const auto add = [](const std::vector<std::string>& sentences, std::vector<std::string>& to) {
    append(to, mapped(sentences, printable));
  };
  add(setup.files, config_texts.made_of);
  add(setup.controllers, config_texts.made_of);
  add(reading.disagreements, config_texts.questions);
  add(reading.remarks, config_texts.questions);
  add(texts.completed.notes, config_texts.questions);
  config_texts.robot = file_seen_from(setup.config, setup.robot);
  for (const std::string& run : setup.runs)
    config_texts.runs.push_back(file_seen_from(setup.config, run));
  texts.robot = format_robot(texts.completed);
  const auto assumed = [](const std::string& note) { return "# " + printable(note) + "\n"; };
  texts.robot.insert(texts.robot.find('\n') + 1, joined(texts.completed.notes, "", assumed));
  texts.config = config_of_robot(texts.completed, config_texts);
  texts.reading = std::move(reading);
  return texts;
}

// Both files, planned before.
Status write_robot(const RobotSetup& setup, const RobotTexts& texts, const Outputs& outputs) {
  if (!setup.robot.empty()) RETURN_IF_ERROR(outputs.write(setup.robot, texts.robot));
  return setup.config.empty() ? Status() : outputs.write(setup.config, texts.config);
}

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

std::string file_seen_from(const std::string& out, const std::string& file) {
  std::error_code error;
  const auto folder = fs::absolute(out == "-" ? "." : out, error).parent_path();
  const auto base = out == "-" ? fs::current_path(error) : folder;
  const auto path = fs::proximate(file, base, error);
  return error || path.empty() ? file : path.string();
}

bool names_a_robot(const std::vector<std::string>& arguments) {
  return std::ranges::any_of(arguments, [](const std::string& word) {
    return ends_with(word, {".urdf", ".xacro", ".xml", ".yaml", ".yml", ".toml"});
  });
}

Result<int> run_init_robot(const std::vector<std::string>& arguments, const std::string& out,
                           Outputs& outputs, CliContext& context) {
  const RobotSetup setup = setup_of_arguments(arguments, out);
  for (const std::string& file : setup.files) {
    if (!ends_with(file, {".csv", ".tsv", ".txt", ".bag", ".db3", ".mcap"})) continue;
    return Error{file +
                 ": is a log, expected a robot's files and folders of runs; gapfarm import "
                 "runs makes such a folder of logs"};
  }
  ASSIGN_OR_RETURN(const RobotTexts texts, set_up_robot(setup, outputs));
  if (out != "-") RETURN_IF_ERROR(outputs.plan(std::vector<std::string>{setup.robot, out}));
  Json json = {{"out", out}, {"robot", setup.robot}, {"runs", setup.runs}};
  if (out != "-") {
    context.begun = true;
    RETURN_IF_ERROR(write_robot(setup, texts, outputs));
  }
  show_config(out, "the robot in " + setup.robot, texts.config, std::move(json), context.console);
  return kExitDone;
}

void show_config(const std::string& out, const std::string& of, const std::string& text, Json json,
                 Console& console) {
  if (out == "-") json["config"] = text;
  const bool asks = text.find("QUESTION:") != std::string::npos;
  console.result(out == "-" ? text
                            : out + ": a config for " + of +
                                  (asks ? "; answer its QUESTIONs, then: " : "; next: ") +
                                  "gapfarm check " + shell_quoted(out) + "\n",
                 json);
}

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
