// What a master says that has nobody to work for it.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace gapfarm {

class WorkerWait {
 public:
  // `endpoints`: where workers may come; none: the master's own are all there will be.
  explicit WorkerWait(const std::vector<std::string>& endpoints);

  // None while there are workers, and at first: they are on their way then, local ones take a
  // while. After half a minute the words say how to start one.  Times are of one clock of the
  // caller's.
  std::optional<std::string> message(std::size_t workers, double now_s);

 private:
  std::string where_;    // "at tcp://..."
  std::string connect_;  // an endpoint for gapfarm-worker; empty: only local workers
  std::optional<double> since_s_;
};

}  // namespace gapfarm
