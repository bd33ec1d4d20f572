#include "master/cli/init_robot.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/parameters/ground.h"
#include "common/robot/robot_file.h"
#include "master/cli/inputs.h"
#include "master/cli/robot_files.h"

namespace gapfarm {
namespace {

namespace fs = std::filesystem;

// What a log usually determines, in the order in which it is read; wheels' radii come first.
constexpr const char* kUsualGenes[] = {"wheel_separation",
                                       "robot_radius",
                                       "full_speed",
                                       "steering.offset",
                                       "steering.gain",
                                       "delay",
                                       "lag",
                                       "marker.x",
                                       "marker.y",
                                       "drive_noise_travel",
                                       "drive_noise_turn",
                                       "pose_noise_position",
                                       "pose_noise_heading"};

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

std::string toml_key(const std::string& key) {
  const auto bare = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.';
  };
  return std::all_of(key.begin(), key.end(), bare) ? key : "\"" + key + "\"";
}

std::string gene_lines(const ParameterTable& table) {
  std::string text;
  const auto add = [&](const Parameter& p) {
    const std::string line = toml_key(p.key) + " = \"table\"";
    text +=
        fmt::format("{:<34}{}\n", line, "# " + (p.unit == "-" ? "" : p.unit + ", ") + p.summary);
  };
  for (const Parameter& p : table.rows()) {
    if (p.key.starts_with("wheels.") && p.key.ends_with(".radius")) add(p);
  }
  for (const char* key : kUsualGenes) {
    if (const auto row = table.find(key)) add(table[*row]);
  }
  return text;
}

std::string config_of_robot(const RobotReading& reading, const GroundRobot& completed,
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
  text +=
      "# What evolution searches; \"table\": half to twice what the robot's file says.\n[genes]\n";
  text += gene_lines(GroundTable(completed).table());
  text +=
      "\n[optimiser]\nkind = \"cma_es\"\nsigma = 0.1\n\n[evolution]\npopulation = 16\n\n"
      "[evolution.stop]\ngenerations = 60\nstagnation_generations = 20\n";
  return text;
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
  const std::string text = config_of_robot(*reading, completed, sorted, out);
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
