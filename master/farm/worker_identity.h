// Who a worker is, for whoever keeps its answers longer than it stays.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

namespace gapfarm {

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
