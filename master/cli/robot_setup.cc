#include "master/cli/init_robot.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/robot/robot_file.h"
#include "master/cli/inputs.h"
#include "master/cli/robot_files.h"
#include "master/robot/robot_config.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

bool is_robot_file(const std::string& word) {
  const std::string extension = fs::path(word).extension().string();
  return extension == ".urdf" || extension == ".xacro" || extension == ".xml" ||
         extension == ".yaml" || extension == ".yml";
}

struct RobotWords {
  std::vector<std::string> files, folders;
};

RobotWords sorted_words(const std::vector<std::string>& words) {
  RobotWords sorted;
  std::error_code ignored;
  for (const std::string& word : words) {
    (fs::is_directory(word, ignored) ? sorted.folders : sorted.files).push_back(word);
  }
  return sorted;
}

// Where the robot goes: husky.toml has its robot in husky_robot.toml.
std::string robot_beside(const std::string& out) {
  if (out == "-") return "robot.toml";
  const fs::path path(out);
  return (path.parent_path() / (path.stem().string() + "_robot.toml")).string();
}

// A comment of one line: sentences come from files.
std::string question(const std::string& sentence) {
  return "# QUESTION: " + printable(sentence) + "\n";
}

std::string questioning_config(const RobotReading& reading, const GroundRobot& completed,
                               const RobotWords& words, const std::string& out) {
  std::string files, folders;
  for (const std::string& file : words.files) files += (files.empty() ? "" : ", ") + file;
  for (const std::string& folder : words.folders) {
    folders += (folders.empty() ? "\"" : ", \"") + file_seen_from(out, folder) + "\"";
  }
  std::string text = fmt::format(
      "# Made by `gapfarm init` of {}.\n"
      "# Lines with QUESTION are guesses; answer them, in the robot's file where they are about "
      "it,\n"
      "# then `gapfarm check` this file.\n"
      "scenario = \"ground\"\nseed = 1\n\n",
      printable(files));
  for (const auto* sentences : {&reading.disagreements, &reading.remarks, &completed.notes}) {
    for (const std::string& sentence : *sentences) text += question(sentence);
  }
  text += "[robot]\nfile = \"" + fs::path(robot_beside(out)).filename().string() + "\"\n\n[runs]\n";
  if (folders.empty()) {
    text += question("where are its runs?  `gapfarm import runs LOG --out drive` makes them.");
    folders = "\"drive\"";
  }
  text += "folders = [" + folders + "]   # commands.csv and poses.csv in each\n\n";
  return text + search_of_driving(completed);
}

}  // namespace

std::string file_seen_from(const std::string& out, const std::string& file) {
  std::error_code error;
  const auto folder = fs::absolute(out == "-" ? "." : out, error).parent_path();
  const auto base = out == "-" ? fs::current_path(error) : folder;
  const auto path = fs::proximate(file, base, error);
  return error || path.empty() ? file : path.string();
}

bool names_a_robot(const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(), is_robot_file);
}

int run_init_robot(const std::vector<std::string>& words, const std::string& out, Outputs& outputs,
                   CliContext& context) {
  Console& console = context.console;
  const RobotWords sorted = sorted_words(words);
  const Result<RobotReading> reading = read_robot_files(sorted.files, {});
  GroundRobot completed;
  Status ready = reading ? Status() : Status(reading.error());
  if (ready) {
    completed = reading->robot;
    if (ready = complete_robot(&completed); !ready) {
      ready = Error{sorted.files[0] + ": " + ready.error().message +
                    "; state it in a robot.toml (docs/formats.md), then gapfarm init that robot's "
                    "URDF again"};
    }
  }
  const std::string robot = robot_beside(out);
  if (ready) {
    for (const std::string& file : sorted.files) outputs.reads(file);
    if (out != "-") ready = outputs.plan(std::vector<std::string>{out, robot});
  }
  if (!ready) {
    console.error(ready.error());
    return kExitBadUsage;
  }
  const std::string text = questioning_config(*reading, completed, sorted, out);
  nlohmann::ordered_json json = {{"out", out}, {"robot", robot}, {"runs", sorted.folders}};
  if (out == "-") {
    json["config"] = text;
    console.result(text, json);
    return kExitDone;
  }
  const std::pair<const std::string*, std::string> files[] = {{&robot, format_robot(completed)},
                                                              {&out, text}};
  for (const auto& [path, content] : files) {
    if (Status s = outputs.write(*path, content); !s) return failed(s.error(), context);
  }
  console.result(out + ": a config for the robot in " + robot +
                     "; answer its QUESTIONs, then: gapfarm check " + out + "\n",
                 json);
  return kExitDone;
}

}  // namespace gapfarm
