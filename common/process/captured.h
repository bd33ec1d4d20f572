// A child process that is waited for, with what it wrote.
#pragma once

#include <functional>
#include <string>

#include "common/base/result.h"
#include "common/process/child.h"

namespace gapfarm {

struct Captured {
  int status = 0;  // of waitpid()
  bool timed_out = false;
  std::string out, err;

  bool succeeded() const { return !timed_out && status == 0; }
};

// Returns when `fd` is readable or `timeout_s` is over, or earlier.
using FdWaiter = std::function<void(int fd, double timeout_s)>;

// Runs it with `input` on its standard input, and kills it after `timeout_s`.  setup.in, .out and
// .err are not looked at.  `wait` (may be empty) is for whoever has other things to wait for, too.
// Error: what kept it from starting.
Result<Captured> run_captured(ChildSetup setup, const std::string& input, double timeout_s,
                              const FdWaiter& wait = {});

}  // namespace gapfarm
