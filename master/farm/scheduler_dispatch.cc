// Who gets what next.

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "master/farm/scheduler.h"

namespace gapfarm {
namespace {

constexpr std::size_t kBatchBytes = std::size_t{1} << 20;

}  // namespace

// Jobs on their way out, a message a worker unless it grows too long.
class Scheduler::Batches {
 public:
  explicit Batches(Scheduler& scheduler) : scheduler_(scheduler) {}

  void add(WorkerRecord& worker, v1::Job* job, double now) {
    job->set_epoch(scheduler_.options_.epoch);
    worker.holds.push_back({job->attempt_id(), now});
    if (scheduler_.options_.on_job) {
      scheduler_.options_.on_job(
          {false, job->job_id(), job->attempt_id(), worker.name, worker.host});
    }
    auto [batch, fresh] = open_.try_emplace(worker.id, Open{0, 0});
    if (fresh || batch->second.bytes > kBatchBytes) {
      scheduler_.post(worker.peer);
      batch->second = {scheduler_.outbox_.size() - 1, 0};
    }
    batch->second.bytes += job->ByteSizeLong();
    scheduler_.outbox_[batch->second.at].envelope.mutable_batch()->add_jobs()->Swap(job);
  }

 private:
  struct Open {
    std::size_t at;  // in the outbox
    std::size_t bytes;
  };
  Scheduler& scheduler_;
  std::unordered_map<WorkerId, Open> open_;
};

void Scheduler::line_up(WorkerRecord& worker) {
  if (worker.in_line) return;
  worker.in_line = true;
  line_.push_back(worker.id);
}

std::size_t Scheduler::credit(const WorkerRecord& worker) const {
  if (worker.leaving || worker.peer.empty()) return 0;
  const std::size_t base = worker.asked_window > 0
                               ? std::min(worker.asked_window, options_.window_max)
                               : std::max(options_.window, 1u);
  if (worker.asked_window > 0 || worker.mean_wall < 0) return base;
  // Of n tasks in hand, each out for t s, a worker is busy for the share n wall / t of the time, so
  // `kBusy` t / wall of them are what it takes to be busy for that share; fewer where it is.
  constexpr double kBusy = 0.95;
  const double wall = std::max(worker.mean_wall, 1e-9);
  const double lasting =
      std::max(std::ceil(options_.window_s / wall) + 1,
               std::ceil(std::min(kBusy * worker.turnaround, options_.window_most_s) / wall));
  const std::size_t wanted =
      static_cast<std::size_t>(std::min(lasting, static_cast<double>(options_.window_max)));
  // Towards the end of a batch nobody takes what others will have time for.
  const std::size_t share = queue_.unfinished() / (2 * registry_.size());
  return std::max(base, std::min(wanted, share));
}

void Scheduler::dispatch(double now) {
  Batches batches(*this);
  dispatch_line(now, batches);
  if (!line_.empty() && queue_.has_straggler(now)) dispatch_stragglers(now, batches);
}

// One job a turn, round the line, so that a short batch spreads over all workers.
void Scheduler::dispatch_line(double now, Batches& batches) {
  std::vector<WorkerId> not_for_them;  // what waits now
  v1::Job job;
  while (queue_.has_pending() && !line_.empty()) {
    WorkerRecord* worker = registry_.find(line_.front());
    line_.pop_front();
    if (worker == nullptr) continue;
    if (worker->holds.size() >= credit(*worker)) {
      worker->in_line = false;
    } else if (queue_.take(*worker, registry_.hosts(), now, &job)) {
      line_.push_back(worker->id);
      batches.add(*worker, &job, now);
    } else {
      not_for_them.push_back(worker->id);
    }
  }
  line_.insert(line_.end(), not_for_them.begin(), not_for_them.end());
}

// Nothing else is left to do for those in line: whoever has nothing at all helps the slowest.
void Scheduler::dispatch_stragglers(double now, Batches& batches) {
  v1::Job job;
  for (WorkerId id : line_) {
    WorkerRecord* worker = registry_.find(id);
    if (worker == nullptr || !worker->holds.empty() || credit(*worker) == 0) continue;
    if (!queue_.take_straggler(*worker, now, &job)) return;
    batches.add(*worker, &job, now);
  }
}

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

void Scheduler::refuse(WorkerRecord& worker, FarmEvent::Kind kind, const std::string& reason) {
  post(worker.peer).mutable_refusal()->set_reason(reason);
  dismiss(worker, kind, "is refused: " + reason);
}

void Scheduler::send_goodbye(const std::string& reason, bool over) {
  std::vector<std::string> peers = fleets_.peers();
  for (const auto& [id, worker] : registry_.all()) peers.push_back(worker->peer);
  leaving_ = true;
  unanswered_.insert(peers.begin(), peers.end());
  for (const std::string& peer : unanswered_) {
    v1::Goodbye* goodbye = post(peer).mutable_goodbye();
    goodbye->set_reason(reason);
    goodbye->set_over(over);
  }
}

FarmTally Scheduler::tally() const {
  FarmTally tally = tally_;
  tally.compared = queue_.compared();
  tally.copies = queue_.copied();
  return tally;
}

}  // namespace gapfarm
