// What stands on a cluster for a master, as its fleet last reported it.
#pragma once

#include <cstdint>
#include <string>

namespace gapfarm {

// Counts are workers.
struct FleetStatus {
  std::string name;
  std::string system;  // "slurm"
  std::string host;    // where it is managed
  unsigned wanted = 0, queued = 0, running = 0;
  std::uint64_t lost = 0;  // ended unasked before they had joined
  std::string why;         // not all that are wanted run; or empty
};

}  // namespace gapfarm
