#include "master/farm/sites/fleet_registry.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostFleets = 100;
constexpr std::size_t kMostNameBytes = 100;
constexpr std::size_t kMostWhyBytes = 500;
// A fleet reports every few seconds, also while its cluster keeps it waiting.
constexpr double kHeardFor_s = 120;

}  // namespace

bool FleetRegistry::hear(const std::string& peer, const v1::Fleet& report, double now) {
  if (report.name().empty() || report.name().size() > kMostNameBytes ||
      report.system().size() > kMostNameBytes || report.host().size() > kMostNameBytes) {
    return false;
  }
  std::erase_if(fleets_, [&](const auto& one) { return now - one.second.at > kHeardFor_s; });
  if (fleets_.size() >= kMostFleets && !fleets_.contains(report.name())) return false;
  FleetStatus status;
  status.name = report.name();
  status.system = report.system();
  status.host = report.host();
  status.wanted = report.wanted();
  status.queued = report.queued();
  status.running = report.running();
  status.lost = report.lost();
  status.why = report.why().substr(0, kMostWhyBytes);
  fleets_[report.name()] = {peer, std::move(status), now};
  return true;
}

std::vector<FleetStatus> FleetRegistry::status(double now) const {
  std::vector<FleetStatus> all;
  for (const auto& [name, heard] : fleets_) {
    if (now - heard.at <= kHeardFor_s) all.push_back(heard.status);
  }
  return all;
}

std::vector<std::string> FleetRegistry::peers() const {
  std::vector<std::string> all;
  for (const auto& [name, heard] : fleets_) all.push_back(heard.peer);
  return all;
}

}  // namespace gapfarm
