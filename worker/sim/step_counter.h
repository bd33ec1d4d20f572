// How far a simulation is, for whoever watches it from another thread or process.
#pragma once

#include <atomic>
#include <cstdint>

namespace gapfarm {

// Goes up by one with every step; written by one thread.  Never read back into a result.
using StepCounter = std::atomic<std::uint64_t>;

inline void count_step(StepCounter* steps) {
  if (steps == nullptr) return;
  // One writer, so a plain increment will do.
  steps->store(steps->load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

}  // namespace gapfarm
