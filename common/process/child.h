// How child processes are started, whatever they are for.
#pragma once

#include <signal.h>
#include <sys/types.h>
#include <unistd.h>

#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

struct ChildSetup {
  std::vector<std::string> arguments;    // program and arguments; without a slash found by PATH
  std::string folder;                    // where it is started; empty: here
  std::vector<std::string> environment;  // "NAME=value", beside this process's and before it
  int in = -1;                           // descriptors; -1: /dev/null
  int out = STDERR_FILENO;               // standard output is often the parent's answer to its user
  int err = STDERR_FILENO;
  int kept = -1;                  // becomes descriptor 3 (ProgressPage::kInheritedFd); -1: none
  int death_signal = SIGKILL;     // sent when the thread that starts it ends; 0: none
  bool leads_group = false;       // a terminal's Ctrl-C does not reach it
  pid_t joins_group = 0;          // the group's leader; 0: none
  bool blocks_interrupt = false;  // until its own handlers stand (StopOnSignals unblocks SIGINT)
  int niceness = 0;
};

// It inherits no other descriptor, no handler and no blocked signal.  Error: what kept it from
// starting, in the system's words ("No such file or directory").
Result<pid_t> start_child(const ChildSetup& setup);

// Waits until it has ended; beyond `patience_s` it is killed.  `status`: of waitpid().  False: it
// was killed.
bool await_child(pid_t pid, double patience_s, int* status);

// A child that is asked to end (SIGTERM) with this, and made to after `patience_s`.
class OwnedChild {
 public:
  OwnedChild(pid_t pid, double patience_s) : pid_(pid), patience_s_(patience_s) {}
  ~OwnedChild();
  OwnedChild& operator=(OwnedChild&&) = delete;

 private:
  pid_t pid_;
  double patience_s_;
};

// Of a status of waitpid(): "exited with status 3", "was killed by signal 9 (Killed)".
std::string end_text(int status);

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
