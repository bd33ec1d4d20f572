#include "master/farm/scheduler.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "common/net/envelope.h"

namespace gapfarm {
namespace {

constexpr std::size_t kBatchBytes = std::size_t{1} << 20;
constexpr std::size_t kDepartedKept = 1000;
constexpr double kForever = std::numeric_limits<double>::infinity();

EndCause cause_of(v1::ProcessEnd end) {
  switch (end) {
    case v1::PROCESS_KILLED:
      return EndCause::kKilled;
    case v1::PROCESS_CRASHED:
      return EndCause::kCrashed;
    default:
      return EndCause::kLeft;
  }
}

bool drop_holding(WorkerRecord& worker, std::uint64_t attempt) {
  const auto at = std::find_if(worker.holds.begin(), worker.holds.end(),
                               [&](const Holding& h) { return h.attempt == attempt; });
  if (at == worker.holds.end()) return false;
  worker.holds.erase(at);
  return true;
}

}  // namespace

Scheduler::Scheduler(SchedulerOptions options)
    : options_(std::move(options)), registry_(options_.admittance), queue_(options_.limits) {}

void Scheduler::report(FarmEvent::Kind kind, const std::string& worker,
                       const std::string& text) const {
  if (options_.on_event) options_.on_event({kind, worker, text});
}

v1::Envelope& Scheduler::post(const std::string& peer) {
  outbox_.emplace_back().peer = peer;
  return outbox_.back().envelope;
}

void Scheduler::start(const std::string& problem_hash, std::vector<v1::Task> tasks) {
  cancel_all();
  departed_.clear();
  queue_.start(problem_hash, std::move(tasks), options_.shuffle_seed);
  for (const auto& [id, worker] : registry_.all()) line_up(*worker);
}

std::vector<v1::TaskResult> Scheduler::finish() {
  cancel_all();
  return queue_.finish();
}

void Scheduler::abandon() {
  cancel_all();
  queue_.abandon();
}

// Between batches nobody holds anything: what is still out has been answered by others or is not
// wanted any more.
void Scheduler::cancel_all() {
  for (const auto& [id, worker] : registry_.all()) {
    if (worker->holds.empty()) continue;
    v1::Cancel* cancel = post(worker->peer).mutable_cancel();
    for (const Holding& holding : worker->holds) cancel->add_attempt_ids(holding.attempt);
    worker->holds.clear();
    worker->doubtful_since = last_tick_;
  }
}

void Scheduler::on_malformed(const std::string& peer) {
  ++counts_.malformed;
  const WorkerRecord* worker = registry_.find_peer(peer);
  if (worker != nullptr) report(FarmEvent::kBadMessage, worker->name, "sent a malformed message");
}

void Scheduler::on_other_protocol(const std::string& peer, std::uint32_t protocol) {
  ++counts_.malformed;
  const std::string reason = "the worker speaks protocol " + std::to_string(protocol) +
                             " and the master " + std::to_string(kProtocol) +
                             "; use the same build on both sides";
  report(FarmEvent::kRefused, "", reason);
  post(peer).mutable_refusal()->set_reason(reason);
}

void Scheduler::on_message(const std::string& peer, v1::Envelope* envelope, double now) {
  if (envelope->has_hello()) {
    on_hello(peer, envelope->hello(), now);
    return;
  }
  WorkerRecord* worker = registry_.find_peer(peer);
  if (worker == nullptr) {
    // Given up for silence, or welcomed by an earlier life of the master.
    if (!envelope->has_goodbye()) post(peer).mutable_hello_request();
    return;
  }
  worker->last_heard = now;
  switch (envelope->body_case()) {
    case v1::Envelope::kHeartbeat:
      on_heartbeat(*worker, envelope->heartbeat(), now);
      break;
    case v1::Envelope::kResult:
      on_result(*worker, envelope->mutable_result());
      break;
    case v1::Envelope::kResults:
      for (v1::JobResult& result : *envelope->mutable_results()->mutable_results()) {
        on_result(*worker, &result);
      }
      break;
    case v1::Envelope::kProblemRequest:
      on_problem_request(*worker, envelope->problem_request().hash());
      break;
    case v1::Envelope::kGoodbye:
      dismiss(*worker, FarmEvent::kLeft, "left: " + envelope->goodbye().reason());
      break;
    default:
      on_malformed(peer);
  }
}

void Scheduler::on_hello(const std::string& peer, const v1::Hello& hello, double now) {
  const WorkerRegistry::Admission admission = registry_.admit(peer, hello, now);
  if (admission.worker == nullptr) {
    report(FarmEvent::kRefused, hello.name(), admission.refusal);
    post(peer).mutable_refusal()->set_reason(admission.refusal);
    return;
  }
  WorkerRecord& worker = *admission.worker;
  if (!hello.replaces().empty() && hello.replaces() != worker.name) {
    on_process_end(hello.replaces(), cause_of(hello.replaced_end()),
                   "its process ended and was replaced by " + worker.name);
  }
  if (admission.returning) {
    // Whatever else was under way to it, or its answers on the way here, may be lost.
    if (hello.epoch() == options_.epoch) {
      keep_only(worker, hello.attempts(), kForever);
    } else {
      keep_only(worker, std::vector<std::uint64_t>{}, kForever);
    }
  }
  report(admission.returning ? FarmEvent::kReturned : FarmEvent::kJoined, worker.name,
         (admission.returning ? "is back on " : "joined from ") + worker.host);
  v1::Welcome* welcome = post(peer).mutable_welcome();
  welcome->set_epoch(options_.epoch);
  welcome->set_heartbeat_interval(options_.heartbeat_interval_s);
  welcome->set_silence_limit(options_.silence_limit_s);
  line_up(worker);
}

template <class List>
void Scheduler::keep_only(WorkerRecord& worker, const List& keeps, double held_since_before) {
  std::vector<Holding> kept;
  std::vector<std::uint64_t> lost;
  for (const Holding& holding : worker.holds) {
    const bool listed = std::find(keeps.begin(), keeps.end(), holding.attempt) != keeps.end();
    if (listed || holding.since >= held_since_before) {
      kept.push_back(holding);
    } else {
      lost.push_back(holding.attempt);
    }
  }
  worker.holds = std::move(kept);
  // From the last to the first, so that they wait in the order in which they went out.
  for (auto attempt = lost.rbegin(); attempt != lost.rend(); ++attempt) {
    if (queue_.give_back(worker.id, *attempt)) ++counts_.retries;
  }
  if (lost.empty()) return;
  worker.doubtful_since = last_tick_;
  line_up(worker);
}

void Scheduler::on_heartbeat(WorkerRecord& worker, const v1::Heartbeat& heartbeat, double now) {
  if (heartbeat.epoch() != options_.epoch) {
    // It missed its welcome and takes this master for an earlier one.
    post(worker.peer).mutable_hello_request();
    return;
  }
  post(worker.peer).mutable_heartbeat()->set_sequence(heartbeat.sequence());
  // Messages do get lost when links break.  A job that should have arrived long ago and is not
  // there, while its answer is not here, is out of the world.
  keep_only(worker, heartbeat.attempts(), now - options_.silence_limit_s);
  // By now nothing that was under way to it then can still arrive.
  if (heartbeat.attempts().empty() && now - worker.doubtful_since > options_.silence_limit_s) {
    worker.doubtful_since = kForever;
    line_up(worker);
  }
}

void Scheduler::on_result(WorkerRecord& worker, v1::JobResult* result) {
  const std::uint64_t attempt = result->attempt_id();
  const Commit commit =
      result->epoch() == options_.epoch ? queue_.commit(worker.id, result) : Commit::kForeign;
  if (commit == Commit::kForeign) {
    ++counts_.foreign;
    return;
  }
  if (drop_holding(worker, attempt)) line_up(worker);
  if (commit == Commit::kLate) {
    ++counts_.late;
    return;
  }
  ++worker.finished;
  const double wall = result->wall();
  if (!std::isfinite(wall) || wall < 0) return;
  worker.mean_wall =
      worker.mean_wall < 0 ? wall : worker.mean_wall + 0.1 * (wall - worker.mean_wall);
}

void Scheduler::on_problem_request(const WorkerRecord& worker, const std::string& hash) {
  v1::ProblemReply* reply = post(worker.peer).mutable_problem_reply();
  reply->set_hash(hash);
  const auto found = problems_.find(hash);
  if (found != problems_.end()) reply->set_problem(found->second);
}

void Scheduler::on_unsent(const std::vector<Outgoing>& messages) {
  // Whatever ended a worker, it was not the jobs that never reached it; so they leave its hands
  // before it is dismissed with what it holds.
  for (const Outgoing& message : messages) {
    WorkerRecord* worker = registry_.find_peer(message.peer);
    if (worker == nullptr) continue;
    for (const v1::Job& job : message.envelope.batch().jobs()) {
      drop_holding(*worker, job.attempt_id());
      if (queue_.give_back(worker->id, job.attempt_id())) ++counts_.retries;
    }
  }
  for (const Outgoing& message : messages) {
    WorkerRecord* worker = registry_.find_peer(message.peer);
    if (worker != nullptr) dismiss(*worker, FarmEvent::kLeft, "cannot be reached");
  }
}

void Scheduler::dismiss(WorkerRecord& worker, FarmEvent::Kind kind, const std::string& text) {
  const std::string name = worker.name;
  if (!worker.holds.empty()) {
    if (departed_.size() > kDepartedKept) departed_.clear();
    departed_[name] = {worker.id, worker.holds.front().attempt};
  }
  keep_only(worker, std::vector<std::uint64_t>{}, kForever);
  registry_.remove(worker.id);
  report(kind, name, text);
}

void Scheduler::on_process_end(const std::string& name, EndCause cause, const std::string& text) {
  WorkerRecord* worker = registry_.find_name(name);
  if (worker != nullptr) dismiss(*worker, FarmEvent::kDied, text);
  const auto departed = departed_.find(name);
  if (departed == departed_.end()) return;
  const auto [id, attempt] = departed->second;
  departed_.erase(departed);
  if (!queue_.blame(id, attempt, cause)) return;
  ++counts_.quarantined;
  report(FarmEvent::kQuarantined, name, "a task was given up: it ended one worker too many");
}

void Scheduler::on_tick(double now) {
  // Nothing was read while the master itself was away (a long commit, a suspended machine), so
  // nobody's silence means anything yet.
  if (now - last_tick_ > options_.silence_limit_s / 2) registry_.forgive(now);
  last_tick_ = now;
  for (WorkerId id : registry_.silent_since(now, options_.silence_limit_s)) {
    dismiss(*registry_.find(id), FarmEvent::kSilent, "was not heard of for too long");
  }
  dispatch(now);
}

void Scheduler::say_goodbye(const std::string& reason) {
  for (const auto& [id, worker] : registry_.all()) {
    post(worker->peer).mutable_goodbye()->set_reason(reason);
  }
}

void Scheduler::line_up(WorkerRecord& worker) {
  if (worker.in_line) return;
  worker.in_line = true;
  line_.push_back(worker.id);
}

std::size_t Scheduler::credit(const WorkerRecord& worker) const {
  const std::size_t base = worker.asked_window > 0
                               ? std::min(worker.asked_window, options_.window_max)
                               : std::max(options_.window, 1u);
  if (worker.asked_window > 0 || worker.mean_wall < 0) return base;
  const double lasting = std::ceil(options_.window_s / std::max(worker.mean_wall, 1e-9)) + 1;
  const std::size_t wanted =
      static_cast<std::size_t>(std::min(lasting, static_cast<double>(options_.window_max)));
  // Towards the end of a batch nobody takes what others will have time for.
  const std::size_t share = queue_.unfinished() / (2 * registry_.size());
  return std::max(base, std::min(wanted, share));
}

// One job a turn, round the line, so that a short batch spreads over all workers.
void Scheduler::dispatch(double now) {
  struct Open {
    std::size_t at;  // in outbox_
    std::size_t bytes;
  };
  std::unordered_map<WorkerId, Open> open;
  v1::Job job;
  while (queue_.has_pending() && !line_.empty()) {
    WorkerRecord* worker = registry_.find(line_.front());
    line_.pop_front();
    if (worker == nullptr) continue;
    const bool empty_handed = worker->holds.empty() && worker->doubtful_since == kForever;
    const bool full = worker->peer.empty() || worker->holds.size() >= credit(*worker) ||
                      (worker->alone && !worker->holds.empty());
    const JobQueue::Taken taken =
        full ? JobQueue::Taken::kNone : queue_.take(worker->id, empty_handed, &job);
    if (taken == JobQueue::Taken::kNone) {
      worker->in_line = false;
      continue;
    }
    line_.push_back(worker->id);
    worker->alone = taken == JobQueue::Taken::kSuspect;
    job.set_epoch(options_.epoch);
    worker->holds.push_back({job.attempt_id(), now});
    auto [batch, fresh] = open.try_emplace(worker->id, Open{0, 0});
    if (fresh || batch->second.bytes > kBatchBytes) {
      post(worker->peer);
      batch->second = {outbox_.size() - 1, 0};
    }
    batch->second.bytes += job.ByteSizeLong();
    outbox_[batch->second.at].envelope.mutable_batch()->add_jobs()->Swap(&job);
  }
}

}  // namespace gapfarm
