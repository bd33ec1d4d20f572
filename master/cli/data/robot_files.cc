#include "master/cli/data/robot_files.h"

#include <filesystem>
#include <initializer_list>
#include <optional>

#include "common/base/try.h"
#include "common/robot/robot_file.h"
#include "common/trials/files.h"
#include "master/io/robot_files/compare_facts.h"
#include "master/io/robot_files/controllers.h"

namespace gapfarm {
namespace {

bool ends_with(const std::string& file, std::initializer_list<const char*> endings) {
  const std::string extension = std::filesystem::path(file).extension().string();
  for (const char* ending : endings) {
    if (extension == ending) return true;
  }
  return false;
}

// A robot.toml says everything itself.
Result<RobotReading> read_toml(const std::string& file) {
  ASSIGN_OR_RETURN(GroundRobot robot, read_robot(file));
  RobotReading reading;
  reading.robot = std::move(robot);
  reading.robot.notes.clear();
  reading.sources.resize(reading.robot.wheels.size());
  reading.evidence.push_back(file + " says so");
  return reading;
}

Result<RobotReading> read_urdf(const std::string& file, const std::vector<DriveFacts>& facts) {
  ASSIGN_OR_RETURN(const std::string text, read_text_file(file));
  ASSIGN_OR_RETURN(const UrdfModel model, parse_urdf(text, file));
  return understand_robot(model, facts);
}

Result<std::vector<DriveFacts>> read_controllers(const std::vector<std::string>& files) {
  std::vector<DriveFacts> facts;
  for (const std::string& file : files) {
    ASSIGN_OR_RETURN(const std::string text, read_text_file(file));
    ASSIGN_OR_RETURN(const ControllerFile read, parse_controllers(text, file));
    facts.insert(facts.end(), read.drives.begin(), read.drives.end());
  }
  return facts;
}

}  // namespace

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
    for (std::string& disagreement : compare_readings(*first, robots[0], next, file)) {
      first->disagreements.push_back(std::move(disagreement));
    }
  }
  return *std::move(first);
}

}  // namespace gapfarm
