// Thousands of workers in one process: the real protocol over a connection each, and no work.
#pragma once

#include <sys/types.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "common/net/keys.h"

namespace gapfarm {

// Counts by logarithmic classes; shared between processes.
class SharedHistogram {
 public:
  void add(double seconds);
  void clear();
  // Of the values' distribution, s; 0 when there are none.  Exact to a tenth.
  double quantile(double share) const;

 private:
  std::array<std::atomic<std::uint32_t>, 256> counts_{};
};

struct FleetOptions {
  std::string endpoint;
  LinkSecurity security;
  unsigned workers = 1;
  double service_s = 0;  // a job takes, by the clock and without a core; 0: answered at once
};

// In a child process, so that its CPU time is not the master's.
class EchoFleet {
 public:
  explicit EchoFleet(const FleetOptions& options);
  ~EchoFleet();
  EchoFleet(const EchoFleet&) = delete;
  EchoFleet& operator=(const EchoFleet&) = delete;

  // From sending a result to the arrival of the next jobs.
  SharedHistogram& latency();
  // CPU time of the fleet so far, s.
  double cpu_s() const;

 private:
  struct Shared;
  Shared* shared_;
  pid_t pid_ = -1;
};

}  // namespace gapfarm
