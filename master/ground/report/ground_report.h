// From what a ground robot's search found to what its diagnosis says.
#pragma once

#include "common/score/kinematic.h"
#include "master/ground/diagnose_ground.h"
#include "master/ground/search.h"

namespace gapfarm {

GroundDiagnosis report_ground(const GroundRobot& robot, const GroundSearch& search,
                              const GroundDiagnoseOptions& options);

// What was chosen or is known, of report_ground()'s values; what lies before measured wheel speeds
// is not the file's.
Kinematics chosen_values(const GroundSearch& search, const std::vector<ReportedValue>& values);

}  // namespace gapfarm
