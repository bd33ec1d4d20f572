// How a simulation ended, in the words of a task's result.
#pragma once

#include <type_traits>

#include "gapfarm/v1/task.pb.h"
#include "worker/sim/robot/motion.h"

namespace gapfarm {

v1::Outcome to_outcome(MotionOutcome outcome);

// Choices are indices, integers are whole, booleans are 0 or 1.
template <typename Setting>
void put(double value, Setting& setting) {
  if constexpr (std::is_same_v<Setting, bool>) {
    setting = value != 0;
  } else if constexpr (std::is_enum_v<Setting>) {
    setting = static_cast<Setting>(static_cast<int>(value));
  } else {
    setting = static_cast<Setting>(value);
  }
}

}  // namespace gapfarm
