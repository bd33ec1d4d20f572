// Answers as they come, for whoever would not lose them to a stop.
#pragma once

#include <cstddef>
#include <functional>

#include "gapfarm/v1/task.pb.h"

namespace gapfarm {

// Reported an answer by its place in the batch.
using AnswerWatcher = std::function<void(std::size_t task, const v1::TaskResult& result)>;

class AnswerSource {
 public:
  virtual ~AnswerSource() = default;
  // From now on every answer is shown to `watcher`, before the run() that asked returns or fails.
  // Empty: nobody.
  virtual void watch_answers(AnswerWatcher watcher) = 0;
};

}  // namespace gapfarm
