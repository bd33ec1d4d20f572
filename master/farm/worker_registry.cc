#include "common/base/ranges.h"
#include "master/farm/scheduler.h"

namespace gapfarm {
namespace {

constexpr std::size_t kGoneKept = 200;
constexpr std::size_t kNameLimit = 200;  // bytes; names go to logs and status

constexpr std::size_t kMostFleets = 100;
constexpr std::size_t kMostNameBytes = 100;
constexpr std::size_t kMostWhyBytes = 500;
// A fleet reports every few seconds, also while its cluster keeps it waiting.
constexpr double kHeardFor_s = 120;

WorkerStatus status_of(const WorkerRecord& worker, const char* state, double now) {
  const double there = now - worker.joined, finished = static_cast<double>(worker.finished);
  return {worker.name,     worker.host,
          state,           static_cast<unsigned>(worker.holds.size()),
          worker.finished, there > 0 ? finished / there : 0};
}

}  // namespace

std::string WorkerRegistry::refusal(const v1::Hello& hello) const {
  if (hello.name().empty() || hello.name().size() > kNameLimit ||
      hello.host().size() > kNameLimit) {
    return "the worker's name must have 1 to 200 bytes and its host's at most 200";
  }
  if (hello.fingerprint() != admittance_.fingerprint) {
    return "the worker's build " + hello.fingerprint() + " is not the master's " +
           admittance_.fingerprint + "; build both from the same sources with the same compiler";
  }
  if (hello.numeric_class().empty()) return "the worker names no numeric class";
  if (!admittance_.allow_mixed_numeric_classes && !admittance_.numeric_class.empty() &&
      hello.numeric_class() != admittance_.numeric_class) {
    return "the worker's numeric class " + hello.numeric_class() + " is not the run's " +
           admittance_.numeric_class +
           ": its machine computes other last bits; use machines of one kind or set "
           "allow_mixed_numeric_classes in [farm] and lose bit-identical runs";
  }
  return "";
}

WorkerRegistry::Admission WorkerRegistry::admit(const std::string& peer, const v1::Hello& hello,
                                                double now) {
  Admission admission;
  admission.refusal = refusal(hello);
  if (!admission.refusal.empty()) return admission;
  if (admittance_.numeric_class.empty()) admittance_.numeric_class = hello.numeric_class();

  WorkerRecord* worker = find_name(hello.name());
  admission.returning = worker != nullptr;
  if (worker == nullptr) {
    auto record = std::make_shared<WorkerRecord>();
    record->id = next_id_++;
    record->name = hello.name();
    record->host = hello.host();
    record->numeric_class = hello.numeric_class();
    record->joined = now;
    ++hosts_[record->host];
    worker = record.get();
    by_name_[worker->name] = worker;
    workers_[worker->id] = std::move(record);
  } else {
    by_peer_.erase(worker->peer);
  }
  // One connection is one worker: whoever spoke on it before has given its place to this one.
  if (WorkerRecord* before = find_peer(peer); before != nullptr && before != worker) {
    before->peer.clear();
  }
  worker->peer = peer;
  by_peer_[peer] = worker;
  worker->asked_window = hello.window();
  worker->leaving = hello.leaving();
  worker->last_heard = now;
  admission.worker = worker;
  return admission;
}

WorkerRecord* WorkerRegistry::find_peer(const std::string& peer) {
  const auto* found = find_in(by_peer_, peer);
  return found ? *found : nullptr;
}

WorkerRecord* WorkerRegistry::find_name(const std::string& name) const {
  WorkerRecord* const* found = find_in(by_name_, name);
  return found ? *found : nullptr;
}

WorkerRecord* WorkerRegistry::find(WorkerId id) {
  const auto found = workers_.find(id);
  return found == workers_.end() ? nullptr : found->second.get();
}

std::vector<WorkerId> WorkerRegistry::silent_since(double now, double limit) const {
  return filtered(
      workers_, [&](auto& one) { return now - one.second->last_heard > limit; },
      [](auto& one) { return one.first; });
}

void WorkerRegistry::forgive(double now) {
  for (auto& [id, worker] : workers_) worker->last_heard = now;
}

void WorkerRegistry::remove(WorkerId id) {
  const auto found = workers_.find(id);
  if (found == workers_.end()) return;
  const WorkerRecord& worker = *found->second;
  gone_.push_back(status_of(worker, "gone", worker.last_heard));
  if (gone_.size() > kGoneKept) gone_.erase(gone_.begin());
  by_name_.erase(worker.name);
  if (--hosts_[worker.host] == 0) hosts_.erase(worker.host);
  if (const auto at = by_peer_.find(worker.peer);
      at != by_peer_.end() && at->second == found->second.get()) {
    by_peer_.erase(at);
  }
  workers_.erase(found);
}

std::vector<WorkerStatus> WorkerRegistry::status(double now) const {
  std::vector<WorkerStatus> all;
  for (const auto& [id, worker] : workers_) {
    const char* state = worker->leaving ? "leaving" : worker->holds.empty() ? "idle" : "busy";
    all.push_back(status_of(*worker, state, now));
  }
  append(all, gone_);
  return all;
}

bool FleetRegistry::hear(const std::string& peer, const v1::Fleet& report, double now) {
  if (report.name().empty() || report.name().size() > kMostNameBytes ||
      report.system().size() > kMostNameBytes || report.host().size() > kMostNameBytes) {
    return false;
  }
  std::erase_if(fleets_, [&](const auto& one) { return now - one.second.at > kHeardFor_s; });
  if (fleets_.size() >= kMostFleets && !fleets_.contains(report.name())) return false;
  const FleetStatus status = {
      report.name(),   report.system(),  report.host(), report.wanted(),
      report.queued(), report.running(), report.lost(), report.why().substr(0, kMostWhyBytes)};
  fleets_[report.name()] = {peer, status, now};
  return true;
}

std::vector<FleetStatus> FleetRegistry::status(double now) const {
  return filtered(
      fleets_, [&](auto& one) { return now - one.second.at <= kHeardFor_s; },
      [](auto& one) { return one.second.status; });
}

std::vector<std::string> FleetRegistry::peers() const {
  return mapped(fleets_, [](const auto& fleet) { return fleet.second.peer; });
}

}  // namespace gapfarm
