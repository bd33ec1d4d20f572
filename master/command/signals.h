// Ctrl-C and SIGTERM for user commands.
#pragma once

#include "common/process/stop.h"

namespace gapfarm {

// While it lives, the first SIGINT or SIGTERM goes to `stop` (a flag and a descriptor to poll), and
// a second one ends the process at once with 128 + signal.  At most one at a time.
class UserInterrupts {
 public:
  explicit UserInterrupts(StopSource* stop);
  ~UserInterrupts();
  UserInterrupts(const UserInterrupts&) = delete;
  UserInterrupts& operator=(const UserInterrupts&) = delete;
};

}  // namespace gapfarm
