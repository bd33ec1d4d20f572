// A page of memory that a worker process shares with the process that started it: whether the
// worker still answers, and whether what it simulates still advances.  It outlives the worker, so
// it also says what a worker that crashed had in work.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "common/base/result.h"

namespace gapfarm {

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

}  // namespace gapfarm
