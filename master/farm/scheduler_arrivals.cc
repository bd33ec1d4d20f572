// Workers that join or come back, and fleets that ask what there is to do.
#include <cmath>

#include "master/farm/scheduler.h"

namespace gapfarm {

// A worker that was silent for too long is the same one afterwards: it was suspended by its
// cluster, or cut off.
void Scheduler::greet(const WorkerRecord& worker, bool returning, double now) {
  const auto silent = silenced_.find(worker.name);
  std::string text =
      (returning || silent != silenced_.end() ? "is back on " : "joined from ") + worker.host;
  if (silent != silenced_.end()) {
    text += " after " + std::to_string(std::lround(now - silent->second)) +
            " s without a word: it was suspended or cut off";
    silenced_.erase(silent);
    returning = true;
  }
  report(returning ? FarmEvent::kReturned : FarmEvent::kJoined, worker.name, text);
}

void Scheduler::on_fleet(const std::string& peer, const v1::Fleet& fleet, double now) {
  if (!fleets_.hear(peer, fleet, now)) return on_malformed(peer);
  v1::Backlog* backlog = post(peer).mutable_backlog();
  backlog->set_unfinished(queue_.unfinished());
  for (const auto& [id, worker] : registry_.all()) {
    if (worker->name.rfind(fleet.name() + "-", 0) != 0) continue;
    v1::Backlog::Worker* one = backlog->add_workers();
    one->set_name(worker->name);
    one->set_idle(worker->holds.empty());
  }
}

}  // namespace gapfarm
