// One world with one robot, used again and again.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "worker/sim/robot/motion.h"
#include "worker/sim/step_counter.h"

namespace gapfarm {

// Deterministic to the bit: run() gives the same answer as the first run() of a new simulator with
// the same settings in a new process, whatever was run before.  One thread at a time.
class Simulator {
 public:
  // REQUIRES: settings within the bounds of the parameter table.
  // `steps` (may be null) outlives the simulator and shows from outside that it advances.
  explicit Simulator(const SimSettings& settings, StepCounter* steps = nullptr);
  ~Simulator();
  Simulator& operator=(Simulator&&) = delete;

  const SimSettings& settings() const;

  // Drives from rest at the origin of S until the robot rests again.  When `path` is given, it
  // receives a sample every `interval_s` from t = 0, and one at rest.
  Motion run(const DriveInput& drive, const Floor& floor, std::vector<MotionSample>* path = nullptr,
             double interval_s = 0);

  // Steps taken and seconds spent inside Bullet's step since construction (benchmarks only).
  std::uint64_t steps() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gapfarm
