// Motions that were simulated already: what a camera does of an effect leaves them as they are.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <vector>

#include "common/parameters/table.h"
#include "common/problem/problem.h"
#include "worker/effects/behaviour.h"
#include "worker/sim/robot/motion.h"
#include "worker/sim/step_counter.h"

namespace gapfarm {

// All that a motion of the tracked robot depends on.
struct MotionKey {
  SimSettings settings;
  DriveInput drive;
  Floor floor;

  bool operator==(const MotionKey&) const = default;
};

// A simulation is a function of its key alone, so what is found is what it would give.  Holds the
// last motions, no more than twice `most`.  Any number of threads.
class MotionMemo {
 public:
  explicit MotionMemo(std::size_t most = 4096) : most_(most) {}

  std::optional<Motion> find(const MotionKey& key) const;
  void keep(const MotionKey& key, const Motion& motion);

 private:
  struct Hash {
    std::size_t operator()(const MotionKey& key) const;
  };
  using Motions = std::unordered_map<MotionKey, Motion, Hash>;

  std::size_t most_;
  mutable std::mutex mutex_;
  Motions young_, old_;
};

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
// Of the user's program.  One that fails throws ExternalFailure, which no ScenarioModel lets out.
std::unique_ptr<Vehicle> make_external_vehicle(const Problem& problem,
                                               const ParameterValues& values, StepCounter* steps);

}  // namespace gapfarm
