#include "master/farm/scheduler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/ranges.h"
#include "common/net/envelope.h"
#include "common/problem/problem.h"

namespace gapfarm {
namespace {

constexpr std::size_t kDepartedKept = 1000;
constexpr std::size_t kOffersKept = 10000;
constexpr double kForever = std::numeric_limits<double>::infinity();

constexpr const char* kImpure =
    "a program that draws numbers without its seed or keeps its past is not pure "
    "(docs/objective.md)"
    ", else this machine computes wrongly";

auto find_holding(WorkerRecord& worker, std::uint64_t attempt) {
  return std::ranges::find_if(worker.holds, [&](const Holding& h) { return h.attempt == attempt; });
}

bool drop_holding(WorkerRecord& worker, std::uint64_t attempt) {
  const auto at = find_holding(worker, attempt);
  if (at == worker.holds.end()) return false;
  worker.holds.erase(at);
  return true;
}

// A task that the worker held has come back after `wall` s of work.
void note_pace(WorkerRecord& worker, std::uint64_t attempt, double wall, double now) {
  constexpr double kNewest = 0.1;  // weight
  const auto at = find_holding(worker, attempt);
  if (!std::isfinite(wall) || wall < 0 || at == worker.holds.end()) return;
  worker.mean_wall =
      worker.mean_wall < 0 ? wall : worker.mean_wall + kNewest * (wall - worker.mean_wall);
  worker.turnaround += kNewest * (now - at->since - worker.turnaround);
}

}  // namespace

Scheduler::Scheduler(SchedulerOptions options)
    : options_(std::move(options)),
      registry_(options_.admittance),
      queue_(options_.job_limits, options_.copies) {}

void Scheduler::report(FarmEvent::Kind kind, const std::string& worker,
                       const std::string& text) const {
  if (!options_.on_event) return;
  const WorkerRecord* known = registry_.find_name(worker);
  options_.on_event({kind, worker, text, known != nullptr ? known->host : ""});
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
  take_offers();
}

// What the batch's problem makes of the task's genome and overrides, in words.
std::string Scheduler::values_of_task(const v1::Task& task) const {
  const auto bytes = problems_.find(queue_.problem_hash());
  v1::Problem message;
  if (bytes == problems_.end() || !message.ParseFromString(bytes->second)) return {};
  const auto problem = from_proto(message);
  const std::string settings = problem ? point_settings(*problem, task) : "";
  if (settings.empty()) return "";
  const bool simulated = !scenario_form(problem->scenario).objective;
  return std::string("; its values") + (simulated ? ", for `gapfarm simulate CONFIG`: " : ": ") +
         settings;
}

void Scheduler::end() {
  cancel_all();
  queue_.end();
}

// What is still out has been answered by others or is not wanted any more.  Who works on it says
// so until it is done.
void Scheduler::cancel_all() {
  for (const auto& [id, worker] : registry_.all()) {
    if (worker->holds.empty()) continue;
    v1::Cancel* cancel = post(worker->peer).mutable_cancel();
    for (const Holding& holding : worker->holds) cancel->add_attempt_ids(holding.attempt);
  }
}

void Scheduler::cancel(const Losers& losers) {
  for (const auto& [id, attempt] : losers) {
    const WorkerRecord* worker = registry_.find(id);
    if (worker != nullptr) post(worker->peer).mutable_cancel()->add_attempt_ids(attempt);
  }
}

void Scheduler::on_malformed(const std::string& peer) {
  ++tally_.malformed;
  const WorkerRecord* worker = registry_.find_peer(peer);
  if (worker != nullptr) report(FarmEvent::kBadMessage, worker->name, "sent a malformed message");
}

void Scheduler::on_other_protocol(const std::string& peer, std::uint32_t protocol) {
  ++tally_.malformed;
  const std::string reason = "the worker speaks protocol " + std::to_string(protocol) +
                             " and the master " + std::to_string(kProtocol) +
                             "; use the same build on both sides";
  report(FarmEvent::kRefused, "", reason);
  post(peer).mutable_refusal()->set_reason(reason);
}

void Scheduler::on_message(const std::string& peer, v1::Envelope* envelope, double now) {
  if (leaving_) {
    if (envelope->has_goodbye()) unanswered_.erase(peer);
    return;
  }
  if (envelope->has_hello()) {
    on_hello(peer, envelope->hello(), now);
    return;
  }
  if (envelope->has_fleet()) {
    on_fleet(peer, envelope->fleet(), now);
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
    case v1::Envelope::kResults:
      for (v1::JobResult& result : *envelope->mutable_results()->mutable_results()) {
        if (!on_result(*worker, &result, now)) return;
      }
      on_dropped(*worker, envelope->results());
      break;
    case v1::Envelope::kOffer:
      on_offer(*worker, envelope->mutable_offer());
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
    ProcessEnded end;
    end.name = hello.replaces();
    end.cause = static_cast<EndCause>(hello.replaced_end());
    end.epoch = hello.replaced_epoch();
    end.attempt = hello.replaced_attempt();
    end.failure = hello.replaced_failure();
    end.text = "its process ended and was replaced by " + worker.name +
               (end.failure.empty() ? "" : ": " + first_line(end.failure));
    on_process_end(end);
  }
  if (admission.returning) {
    // Whatever else was under way to it, or its answers on the way here, may be lost.
    if (hello.epoch() == options_.epoch) {
      keep_only(worker, hello.attempts(), kForever);
    } else {
      keep_only(worker, std::vector<std::uint64_t>{}, kForever);
    }
  }
  greet(worker, admission.returning, now);
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
    const bool listed = contains(keeps, holding.attempt);
    if (listed || holding.since >= held_since_before) {
      kept.push_back(holding);
    } else {
      lost.push_back(holding.attempt);
    }
  }
  worker.holds = std::move(kept);
  // From the last to the first, so that they wait in the order in which they went out.
  for (auto attempt = lost.rbegin(); attempt != lost.rend(); ++attempt) {
    if (queue_.give_back(worker.id, *attempt)) ++tally_.retries;
  }
  if (!lost.empty()) line_up(worker);
}

void Scheduler::on_heartbeat(WorkerRecord& worker, const v1::Heartbeat& heartbeat, double now) {
  if (heartbeat.epoch() != options_.epoch) {
    // It missed its welcome and takes this master for an earlier one.
    post(worker.peer).mutable_hello_request();
    return;
  }
  worker.leaving |= heartbeat.leaving();
  post(worker.peer).mutable_heartbeat();
  // Messages do get lost when links break.  A job that should have arrived long ago and is not
  // there, while its answer is not here, is out of the world.
  keep_only(worker, heartbeat.attempts(), now - options_.silence_limit_s);
}

bool Scheduler::on_result(WorkerRecord& worker, v1::JobResult* result, double now) {
  if (result->epoch() != options_.epoch) {
    ++tally_.foreign;
    return true;
  }
  const std::uint64_t attempt = result->attempt_id();
  const double wall = result->wall();
  const Committed committed = queue_.commit(registry_.identity(worker), result);
  if (committed.kind == Commit::kNoAnswer) {
    // Broken or lying: nothing else that it says is worth waiting for.
    ++tally_.malformed;
    refuse(worker, FarmEvent::kBadMessage, "it answered a task with something that is no result");
    return false;
  }
  if (committed.kind == Commit::kUnfit) {
    const bool alone = registry_.size() == 1;
    refuse(worker, FarmEvent::kRefused,
           "it cannot work on this problem: " + result->result().message() +
               (alone ? "; no worker that can is left" : ""));
    return false;
  }
  // Nonsense about a job leaves it in the worker's hands, to be given back with the rest of them.
  if (committed.kind != Commit::kForeign) note_pace(worker, attempt, wall, now);
  const bool held = committed.kind == Commit::kForeign && queue_.is_out(worker.id, attempt);
  if (!held && drop_holding(worker, attempt)) line_up(worker);
  on_committed(committed);
  if (committed.kind != Commit::kDone) return true;
  ++worker.finished;
  if (options_.on_job) {
    options_.on_job({true, result->job_id(), attempt, worker.name, worker.host});
  }
  return true;
}

void Scheduler::on_committed(const Committed& committed) {
  if (committed.kind == Commit::kForeign) ++tally_.foreign;
  if (committed.kind == Commit::kLate) ++tally_.late;
  cancel(committed.losers);
  if (!committed.disagreement) return;
  ++tally_.alarms;
  const Disagreement& d = *committed.disagreement;
  report(FarmEvent::kDisagreement, d.second->name,
         d.question + " has two answers: " + d.first->name + " on " + d.first->host +
             " gave one answer and " + d.second->name + " on " + d.second->host + " another; " +
             (d.first->host == d.second->host
                  ? kImpure
                  : "one of these machines computes wrongly, take it off the farm"));
}

void Scheduler::on_dropped(WorkerRecord& worker, const v1::ResultBatch& batch) {
  if (batch.epoch() != options_.epoch) return;
  for (std::uint64_t attempt : batch.dropped()) {
    if (drop_holding(worker, attempt)) line_up(worker);
    if (queue_.give_back(worker.id, attempt)) ++tally_.retries;
  }
}

void Scheduler::on_offer(WorkerRecord& worker, v1::Offer* offer) {
  for (v1::Offer::Answer& answer : *offer->mutable_answers()) {
    if (offers_.size() >= kOffersKept) offers_.pop_front();
    offers_.push_back({registry_.identity(worker), std::move(answer)});
  }
  if (queue_.unfinished() > 0) take_offers();
}

// A question that nobody asks in this batch will hardly be asked in the next.
void Scheduler::take_offers() {
  for (Offered& offered : offers_) {
    const Committed committed = queue_.commit_question(offered.by, offered.answer.question(),
                                                       offered.answer.mutable_result());
    if (committed.kind == Commit::kForeign) continue;
    if (committed.kind == Commit::kDone) ++tally_.handed_over;
    on_committed(committed);
  }
  offers_.clear();
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
    unanswered_.erase(message.peer);
    WorkerRecord* worker = registry_.find_peer(message.peer);
    if (worker == nullptr) continue;
    for (const v1::Job& job : message.envelope.batch().jobs()) {
      drop_holding(*worker, job.attempt_id());
      if (queue_.give_back(worker->id, job.attempt_id())) ++tally_.retries;
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
    departed_[name] = registry_.identity(worker);
  }
  keep_only(worker, std::vector<std::uint64_t>{}, kForever);
  registry_.remove(worker.id);
  report(kind, name, text);
}

void Scheduler::on_process_end(const ProcessEnded& end) {
  WorkerRecord* worker = registry_.find_name(end.name);
  if (worker != nullptr) dismiss(*worker, FarmEvent::kDied, end.text);
  const auto departed = departed_.find(end.name);
  if (departed == departed_.end()) return;
  if (end.epoch != options_.epoch || end.attempt == 0) return;
  Blamed blamed = queue_.blame(*departed->second, end.attempt, end.cause, end.failure);
  departed_.erase(departed);
  if (end.cause == EndCause::kHung) ++tally_.hung;
  if (!blamed.quarantined) return;
  ++given_up_;
  blamed.reason += values_of_task(blamed.task);
  report(FarmEvent::kQuarantined, end.name, blamed.reason);
  cancel(blamed.losers);
}

void Scheduler::on_tick(double now) {
  // Nothing was read while the master itself was away (a long commit, a suspended machine), so
  // nobody's silence means anything yet.
  if (now - last_tick_ > options_.silence_limit_s / 2) registry_.forgive(now);
  last_tick_ = now;
  for (WorkerId id : registry_.silent_since(now, options_.silence_limit_s)) {
    WorkerRecord& worker = *registry_.find(id);
    if (silenced_.size() > kDepartedKept) silenced_.clear();
    silenced_[worker.name] = worker.last_heard;
    dismiss(worker, FarmEvent::kSilent, "was not heard of for too long");
  }
  dispatch(now);
}

}  // namespace gapfarm
