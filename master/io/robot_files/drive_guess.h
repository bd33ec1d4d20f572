// Which kind of drive the wheels of a chassis make, and which way is ahead.
#pragma once

#include "common/robot/robot.h"
#include "master/io/robot_files/chassis.h"

namespace gapfarm {

struct DriveGuess {
  DriveKind drive = DriveKind::kDifferential;
  bool parallel = true;    // the axles of all wheels that do not steer
  double forward_rad = 0;  // the way ahead in frame B
  std::vector<std::string> evidence;
  std::vector<std::string> remarks;
};

// By the wheels and what `facts` state.  Errors: none of gapfarm's drives, with what was found.
// REQUIRES: ChassisWheel::named says which wheels are driven.
Result<DriveGuess> guess_drive(const UrdfModel& model, const Chassis& chassis,
                               const std::vector<DriveFacts>& facts);

}  // namespace gapfarm
