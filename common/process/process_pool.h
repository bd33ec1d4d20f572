// A fixed number of child processes of one program, started again when they end.
#pragma once

#include <sys/types.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace gapfarm {

// A page of memory that a worker process shares with the process that started it: whether the
// worker still answers, and whether what it simulates still advances.  It outlives the worker, so
// it also says what a worker that crashed had in work.

// Written by the worker, read by its parent.
struct WorkerProgress {
  std::atomic<std::uint64_t> beats{0};    // rounds of the thread that owns the socket
  std::atomic<std::uint64_t> steps{0};    // of the simulation, since the process began
  std::atomic<std::uint64_t> epoch{0};    // of the master's life that gave out `attempt`
  std::atomic<std::uint64_t> attempt{0};  // in work; 0: none
  // Why the worker ends, written by report_failure() before it does; else all zeros.
  std::array<char, 3072> failure{};

  void report_failure(const std::string& why);  // cut to the room that there is
  // For the parent, once the worker has ended: "" where it reported nothing.
  std::string reported_failure() const;
};
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

// The mapping of one page.
class ProgressPage {
 public:
  // The descriptor under which a child finds the page that its parent made.
  static constexpr int kInheritedFd = 3;

  // A new page.  Errors: no memory, no descriptors.
  static Result<ProgressPage> create();
  // The parent's, or one of this process's own when descriptor kInheritedFd is no such page.
  static Result<ProgressPage> inherit();

  ProgressPage(ProgressPage&& other) noexcept;
  ProgressPage& operator=(ProgressPage&& other) noexcept;
  ~ProgressPage();

  WorkerProgress& operator*() const { return *progress_; }
  WorkerProgress* operator->() const { return progress_; }
  int fd() const { return fd_; }  // closed on exec

 private:
  ProgressPage(int fd, WorkerProgress* progress) : fd_(fd), progress_(progress) {}
  static Result<ProgressPage> map(int fd);

  int fd_ = -1;
  WorkerProgress* progress_ = nullptr;
};

// How a process ended, as far as blame goes; a supervisor's workers report the number.
enum class EndCause {
  kLeft,     // exit status 0 or kExitNoMaster, or a signal that asks to leave: nobody's fault
  kKilled,   // SIGKILL: from outside or out of memory
  kCrashed,  // any other signal or exit status
  kStuck,    // killed by its parent: it did not answer at all, which says nothing about its work
  kHung,     // killed by its parent: it answered, but its simulation did not advance
};

// Exit status of a child that starting again would not help: wrong usage, or refused for good.
inline constexpr int kExitUsage = 2;
inline constexpr int kExitRefused = 78;
// No master for as long as it was to wait, and the last one had not said that its work was over.
inline constexpr int kExitNoMaster = 69;

// A reported failure without the line on how to repeat it.
inline std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

struct ProcessEnded {
  std::string name;
  pid_t pid = 0;
  EndCause cause = EndCause::kLeft;
  // What it had in work, by its progress page; 0: nothing.
  std::uint64_t epoch = 0;
  std::uint64_t attempt = 0;
  // Of one that reported why it ended: a sentence, and perhaps a line on how to repeat it by hand.
  std::string failure;
  int exit_status = 0;   // of one that exited by itself
  bool gave_up = false;  // its place stays empty
  std::string text;      // "local-1 (pid 42) was killed by signal 11 (Segmentation fault)"
};

// Two clocks over every child's progress page.  A child that exceeds one is killed; 0: no limit.
struct ProcessLimits {
  // Something is in work and no step of it is done for so long, while the process answers.
  double progress_s = 60;
  // The process does not answer: stopped, starved or deadlocked.  Says nothing about its work.
  double answer_s = 60;
};

struct ProcessPoolOptions {
  std::string program;  // path
  unsigned count = 1;
  std::string name_prefix;  // names are prefix-PLACE.START, never used twice
  // Arguments after the program.  `replaced` is the end that this start makes up for, or null.
  std::function<std::vector<std::string>(const std::string& name, const ProcessEnded* replaced)>
      arguments;
  // A place is given up after so many ends in a row without a confirm(); none: never.
  std::optional<unsigned> failure_limit = 3;
  bool replaces_leavers = true;  // false: once a child has left by itself, no other is started
  double healthy_s = 10;         // a child that lived so long counts as confirmed
  double backoff_s = 0.1;  // before the second start in a row without a confirm(), then doubled
  double backoff_max_s = 30;
  ProcessLimits limits;
};

// Children die with the thread that starts them (ChildSetup::death_signal), so start and reap from
// a thread that lives as long as the pool. Times are seconds of one monotonic clock that the caller
// reads.
class ProcessPool {
 public:
  explicit ProcessPool(ProcessPoolOptions options);
  // Kills what is left.
  ~ProcessPool();
  ProcessPool& operator=(ProcessPool&&) = delete;

  Status start(double now);
  // Kills the children that exceed a limit, collects those that ended and starts those that are
  // due.  To be called every look_interval().
  std::vector<ProcessEnded> reap(double now);
  // How long, s, reap() may wait at most, or it would take itself for one that was away.
  double look_interval() const;
  // When reap() has something to start; infinity: never.
  double next_start() const;
  // The child does useful work: its failures so far are forgotten.
  void confirm(const std::string& name);
  // No child runs and none will be started.
  bool exhausted() const;
  std::size_t running() const { return pids().size(); }
  std::vector<pid_t> pids() const;  // of the running children

  // Readable when a child has ended; for poll().
  std::vector<int> fds() const;

  // From now on nothing is started again.
  void retire() { retired_ = true; }
  // REQUIRES: a signal number.  Sends it to every running child.
  void signal_all(int signal);
  // Waits until all have ended; false after `timeout_s`.  Retires the pool.
  bool wait_all(double timeout_s);

 private:
  struct Place {
    std::string name;
    pid_t pid = 0;  // 0: not running
    int pidfd = -1;
    unsigned starts = 0;
    unsigned failures = 0;  // ends in a row without a confirm()
    double start_at = 0;    // when it started, or will when it does not run
    bool gave_up = false;
    std::optional<ProcessEnded> replaced;
    std::optional<ProgressPage> page;  // of the running child
    // The page as it was seen last, and since when.
    std::uint64_t beats = 0;
    std::uint64_t steps = 0;
    std::uint64_t attempt = 0;
    double answered_at = 0;
    double advanced_at = 0;
    std::optional<EndCause> verdict;  // it was killed for this
  };
  Status start_place(Place& place, unsigned index);
  ProcessEnded ended(Place& place, int status, double now);
  double shortest_limit() const;
  void watch(double now);
  void look_at(Place& place, double now);

  ProcessPoolOptions options_;
  std::vector<Place> places_;
  bool retired_ = false;
  double last_look_ = 0;
};

// Of the running executable; empty when /proc is missing.
std::string executable_path();

}  // namespace gapfarm
