// Runs jobs in child processes, a few at a time, each with a time limit.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/process/stop.h"

namespace gapfarm {

struct ChildJob {
  std::string id;
  std::vector<std::string> argv;  // argv[0]: path of the program
  std::string log_path;           // its stdout and stderr
};

enum class ChildState { kDone, kFailed, kCrashed, kTimedOut };
const char* child_state_name(ChildState state);  // "done", "failed", "crashed", "timeout"

struct ChildEnd {
  ChildState state = ChildState::kDone;
  int status = 0;  // exit status, or the signal of a crash
  double wall_s = 0;
  std::string text;  // "exited with status 3"; empty when done
  double cpu_s = 0;  // of the child and of its own children that it waited for
};

struct ChildrenOptions {
  unsigned at_once = 1;
  double time_limit_s = 1800;
  StopSource* stop = nullptr;  // not owned
  // Exit statuses that count as done.
  std::function<bool(int status)> done = [](int status) { return status == 0; };
  std::function<void(const ChildJob& job, const ChildEnd& end)> on_end;
  std::function<void(std::size_t ended)> on_tick;  // now and then
};

// Runs all jobs in order; returns when the last has ended.  Every child leads a process group of
// its own (a terminal's Ctrl-C does not reach it), inherits no descriptor, and dies with this
// thread; a child beyond its limit is asked to end, then made to, with all its group. Errors:
// kStopped, after the running children were ended (they are not reported); a program that
// cannot be started.
Status run_children(const std::vector<ChildJob>& jobs, const ChildrenOptions& options);

}  // namespace gapfarm
