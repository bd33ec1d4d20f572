#include "master/robot/robot_config.h"

#include <set>
#include <vector>

#include "common/parameters/ground.h"

namespace gapfarm {
namespace {

// What a log of free driving tells; rows that the robot's table does not have are left out.
std::vector<std::string> told_by_driving(const GroundRobot& robot) {
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
      keys.insert(keys.end(), {"wheel_separation", "roller_drag"});
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

}  // namespace

std::string config_of_robot(const GroundRobot& robot, const std::string& robot_file,
                            const std::string& runs) {
  std::string text = "# A ground robot, fitted to logs of it driving (docs/ground.md).\n";
  text += "scenario = \"ground\"\n\n[robot]\nfile = \"" + robot_file + "\"\n\n";
  text += "[runs]\nfolders = [\"" + runs + "\"]  # of gapfarm import runs\n\n";
  text += "[genes]  # bounds: half the file's value to twice it; gapfarm check lists them\n";
  const GroundTable rows(robot);
  for (const std::string& key : told_by_driving(robot)) {
    if (rows.table().find(key)) text += key + " = \"table\"\n";
  }
  text += "\n[optimiser]\nkind = \"cma_es\"\nsigma = 0.1\n\n";
  text += "[evolution]\nstop = { evaluations = 600 }\n";
  return text;
}

}  // namespace gapfarm
