// The master's side of fleets: who has workers on a cluster for it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "gapfarm/v1/farm.pb.h"
#include "master/farm/sites/fleet_status.h"

namespace gapfarm {

// Times are seconds of the caller's clock.
class FleetRegistry {
 public:
  // False: this is no fleet's report, or there are too many fleets.
  bool hear(const std::string& peer, const v1::Fleet& report, double now);
  // Of those that were heard of lately.
  std::vector<FleetStatus> status(double now) const;
  std::vector<std::string> peers() const;

 private:
  struct Heard {
    std::string peer;
    FleetStatus status;
    double at = 0;
  };
  std::map<std::string, Heard> fleets_;  // by name
};

}  // namespace gapfarm
