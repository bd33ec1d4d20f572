// What drives a command: a robot on two sides, simulated here or by somebody else's program.
#pragma once

#include <memory>
#include <vector>

#include "common/parameters/table.h"
#include "common/problem/problem.h"
#include "worker/effects/behaviour.h"
#include "worker/scenarios/srv1/motion_memo.h"
#include "worker/sim/robot/motion.h"
#include "worker/sim/step_counter.h"

namespace gapfarm {

class Vehicle {
 public:
  virtual ~Vehicle() = default;
  // From rest at the origin of S until it rests again.  When `path` is given, it receives a sample
  // every `interval_s` from t = 0, and one at rest.
  virtual Motion run(const DriveInput& drive, const Floor& floor, std::vector<MotionSample>* path,
                     double interval_s) = 0;
};

// The simulation of the problem's scenario at these values.  `memo` (may be null) holds motions
// that need not be simulated again; one that is asked for with its path is.
std::unique_ptr<Vehicle> make_vehicle(const Problem& problem, const ParameterValues& values,
                                      const ActiveEffects& effects, StepCounter* steps,
                                      MotionMemo* memo);

}  // namespace gapfarm
