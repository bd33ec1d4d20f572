// Between simulations and the words of tasks and their results.
#pragma once

#include <string>
#include <type_traits>

#include "common/random/stream.h"
#include "common/score/fitness.h"
#include "gapfarm/v1/task.pb.h"
#include "worker/sim/robot/motion.h"

namespace gapfarm {

inline v1::Outcome to_outcome(MotionOutcome outcome) {
  constexpr v1::Outcome kOutcomes[] = {v1::OK, v1::DIVERGED, v1::FELL_OVER, v1::NEVER_RESTED};
  return kOutcomes[static_cast<std::size_t>(outcome)];
}

inline MotionFacts facts_of(const Motion& motion) {
  return {motion.max_roll_rad, motion.max_pitch_rad, motion.max_heave_m, motion.rest_time_s};
}

inline v1::TaskResult failed_task(v1::Outcome outcome, const std::string& message) {
  v1::TaskResult result;
  result.set_outcome(outcome);
  result.set_message(message);
  return result;
}

// The stream of a task's draws for this purpose; of one of its trials, `trial` in place of the
// replicate.
inline StreamKey stream_key(const v1::StreamKey& task, Purpose purpose, std::uint64_t trial) {
  return {task.run_seed(), purpose, task.generation(), task.birth_id(), trial};
}
inline StreamKey stream_key(const v1::StreamKey& task, Purpose purpose) {
  return stream_key(task, purpose, task.replicate());
}

// The noise of one reading.
inline Pose drawn_noise(const PoseNoise& noise, Stream& stream) {
  const double x = noise.position_m * stream.normal();
  const double y = noise.position_m * stream.normal();
  return {x, y, noise.heading_rad * stream.normal()};
}

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
