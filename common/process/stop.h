// A request to stop that interrupts a poll: from a signal, or from another thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>

namespace gapfarm {

class StopSource {
 public:
  StopSource();
  ~StopSource();
  StopSource& operator=(StopSource&&) = delete;

  // Async-signal-safe and thread-safe.  `signal` is kept for the exit status; 0: no signal.
  // False: a SIGTERM right after another, which is one request.
  bool request(int signal = 0);
  bool requested() const {
    heeded_.store(true);
    return requests() > 0;
  }
  // How often: a second request usually means "at once".
  unsigned requests() const { return requests_.load(); }
  // Whether anybody has ever asked for requests or for fd(): until then nobody would see one.
  bool heeded() const { return heeded_.load(); }
  int signal() const { return signal_.load(); }  // of the last request

  // Readable once requested, until acknowledge(); for poll().
  int fd() const {
    heeded_.store(true);
    return fd_;
  }
  // Makes fd() wait for the next request; requests() keeps its count.
  void acknowledge();

 private:
  int fd_;
  mutable std::atomic<bool> heeded_{false};
  std::atomic<unsigned> requests_{0};
  std::atomic<int> signal_{0};
  std::atomic<std::int64_t> terminated_ns_;  // the last SIGTERM that counted
};

// While it lives, SIGINT, SIGTERM and, unless it was ignored before, SIGHUP go to `stop`;
// afterwards the old handlers are back.  At most one at a time (signal handlers are the process's
// own).
class StopOnSignals {
 public:
  enum Way {
    kEach,             // of them is a request
    kIgnoreInterrupt,  // a terminal's Ctrl-C also reaches the children of whom it is meant for
    // A request ends the process with 128 + signal where none is heeded yet, and so does a second.
    kSecondEnds,
  };
  explicit StopOnSignals(StopSource* stop, Way way = kEach);
  ~StopOnSignals();
  StopOnSignals& operator=(StopOnSignals&&) = delete;

 private:
  struct Saved;
  std::unique_ptr<Saved> saved_;
};

}  // namespace gapfarm
