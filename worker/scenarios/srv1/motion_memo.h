// Motions that were simulated already: what a camera does of an effect leaves them as they are.
#pragma once

#include <cstddef>
#include <mutex>
#include <optional>
#include <unordered_map>

#include "worker/sim/robot/motion.h"

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

}  // namespace gapfarm
