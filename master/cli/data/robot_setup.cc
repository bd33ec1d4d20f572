#include "master/cli/data/robot_setup.h"

#include <algorithm>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/robot/robot.h"
#include "common/trials/files.h"
#include "master/io/robot_files/controllers.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

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

}  // namespace

Result<RobotTexts> set_up_robot(const RobotSetup& setup, Outputs& outputs) {
  ASSIGN_OR_RETURN(RobotReading reading, read_robot_files(setup.files, setup.controllers));
  RobotTexts texts;
  texts.completed = reading.robot;
  if (const Status s = complete_robot(&texts.completed); !s) {
    return Error{setup.files[0] + ": " + s.error().message +
                 "; state it in a robot.toml (docs/formats.md) and give that"};
  }
  for (const auto* files : {&setup.files, &setup.controllers}) {
    for (const std::string& file : *files) outputs.reads(file);
  }
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

Status write_robot(const RobotSetup& setup, const RobotTexts& texts, const Outputs& outputs) {
  if (!setup.robot.empty()) RETURN_IF_ERROR(outputs.write(setup.robot, texts.robot));
  return setup.config.empty() ? Status() : outputs.write(setup.config, texts.config);
}

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
  console.result(out == "-" ? text
                            : out + ": a config for " + of +
                                  "; answer its QUESTIONs, then: gapfarm check " +
                                  shell_quoted(out) + "\n",
                 json);
}

}  // namespace gapfarm
