#include "master/io/robot_files/robot_config.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <vector>

#include "common/parameters/ground.h"

namespace gapfarm {
namespace {

// What a log of free driving shows; rows that the robot's table does not have are omitted.
std::vector<std::string> identified_by_driving(const GroundRobot& robot) {
  std::vector<std::string> keys;
  std::set<std::string> groups;
  for (const RobotWheel& w : robot.wheels) {
    if (w.driven && groups.insert(w.group).second) keys.push_back("wheels." + w.group + ".radius");
  }
  switch (robot.drive) {
    case DriveKind::kSkid:
      keys.insert(keys.end(), {"friction_ratio", "friction", "creep"});
      break;
    case DriveKind::kTracked:
      keys.insert(keys.end(), {"contact_length", "friction_ratio", "friction", "creep"});
      break;
    case DriveKind::kOmni:
      keys.insert(keys.end(), {"robot_radius", "roller_drag"});
      break;
    case DriveKind::kMecanum:
      keys.insert(keys.end(),
                  {"wheel_separation", "roller_drag", "friction", "creep_speed", "cross_load"});
      break;
    case DriveKind::kDifferential:
      keys.insert(keys.end(), {"wheel_separation"});
      break;
    default:
      keys.insert(keys.end(), {"steering.offset", "steering.gain", "understeer", "friction",
                               "throttle.gain", "throttle.drag"});
  }
  keys.insert(keys.end(), {"delay", "lag", "marker.x", "marker.y", kGroundTravelNoise,
                           kGroundTurnNoise, kGroundPositionNoise, kGroundHeadingNoise});
  return keys;
}

std::string toml_key(const std::string& key) {
  const auto bare = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' || c == '.';
  };
  return std::all_of(key.begin(), key.end(), bare) ? key : "\"" + key + "\"";
}

// The sections [genes], [optimiser] and [evolution].
std::string search_of_driving(const GroundRobot& robot) {
  const GroundTable rows(robot);
  std::string text = "[genes]  # \"table\": half to twice what the robot's file says\n";
  for (const std::string& key : identified_by_driving(robot)) {
    const auto row = rows.table().find(key);
    if (!row) continue;
    const Parameter& p = rows.table()[*row];
    std::string line = toml_key(key) + " = \"table\"";
    line.resize(std::max<std::size_t>(line.size() + 1, 34), ' ');
    text += line + "# " + (p.unit == "-" ? "" : p.unit + ", ") + p.summary + "\n";
  }
  return text +
         "\n[optimiser]\nkind = \"cma_es\"\nsigma = 0.1\n\n"
         "[evolution]\nstop = { evaluations = 600 }\n";
}

std::string joined(const std::vector<std::string>& texts, const char* around) {
  std::string text;
  for (const std::string& word : texts) {
    text += (text.empty() ? "" : ", ") + (around + word) + around;
  }
  return text;
}

}  // namespace

std::string config_of_robot(const GroundRobot& robot, const RobotConfigTexts& texts) {
  std::string text =
      "# A ground robot, fitted to logs of it driving (docs/ground.md), made of " +
      joined(texts.made_of, "") +
      ".\n"
      "# Lines with QUESTION are guesses; answer them, in the robot's file where they are about "
      "it,\n# then `gapfarm check` this file.\nscenario = \"ground\"\nseed = 1\n\n";
  for (const std::string& sentence : texts.questions) text += "# QUESTION: " + sentence + "\n";
  text += "[robot]\nfile = \"" + texts.robot + "\"\n\n[runs]\n";
  if (texts.runs.empty()) {
    text += "# QUESTION: where are its runs?  `gapfarm import runs LOG --out drive` makes them.\n";
  }
  text += "folders = [" + (texts.runs.empty() ? "\"drive\"" : joined(texts.runs, "\"")) +
          "]   # commands.csv and poses.csv in each\n\n";
  return text + search_of_driving(robot);
}

}  // namespace gapfarm
