// Answers as they come, for whoever would not lose them to a stop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

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

using WorkerId = std::uint64_t;

struct WorkerIdentity {
  WorkerId id = 0;
  std::string name;  // its own, unique: a process that replaces it has another
  std::string host;
  std::string numeric_class;
};

// How many workers each host has.
using HostCounts = std::map<std::string, unsigned>;

using WorkerIdentityPtr = std::shared_ptr<const WorkerIdentity>;

}  // namespace gapfarm
