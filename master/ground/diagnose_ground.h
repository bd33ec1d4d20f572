// The diagnosis of a ground robot: which one thing of its file or log is wrong, by how much, and
// what else is (docs/ground.md).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/robot/robot.h"
#include "common/runs/run.h"
#include "common/runs/windows.h"
#include "master/diagnose/diagnosis.h"

namespace gapfarm {

struct GroundDiagnoseOptions {
  WindowSettings windows = {{0.5, 2, 5}, 0.5};
  std::vector<std::string> left_out;  // hypotheses that are not to be thought of
  std::uint64_t seed = 1;             // of the bootstrap
  std::function<void(const std::string& stage)> on_stage;
};

struct GroundDiagnosis {
  Diagnosis diagnosis;
  GroundRobot corrected;  // the robot with what was named put in
};

// Errors: no window fits, a hypothesis to leave out that there is not.
Result<GroundDiagnosis> diagnose_ground(const GroundRobot& robot, const RunLog& log,
                                        const GroundDiagnoseOptions& options);

// What a log has the wrong way round or in another unit, in seconds, nothing fitted.
std::vector<SanityFinding> check_ground_log(const GroundRobot& robot, const RunLog& log);

}  // namespace gapfarm
