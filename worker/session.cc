#include "worker/session.h"

#include <algorithm>
#include <utility>

#include "common/base/hash.h"
#include "common/net/envelope.h"

namespace gapfarm {
namespace {

constexpr std::size_t kProblemsKept = 4;
constexpr std::size_t kResultBytes = std::size_t{1} << 20;  // a message of results

}  // namespace

void WorkerSession::on_message(v1::Envelope* envelope, double now) {
  if (state_ == State::kRefused || state_ == State::kDismissed) return;
  last_heard_ = now;
  switch (envelope->body_case()) {
    case v1::Envelope::kWelcome:
      on_welcome(envelope->welcome(), now);
      break;
    case v1::Envelope::kRefusal:
      state_ = State::kRefused;
      reason_ = envelope->refusal().reason();
      break;
    case v1::Envelope::kHelloRequest:
      greet(now);
      break;
    case v1::Envelope::kJob:
      on_job(envelope->mutable_job());
      break;
    case v1::Envelope::kBatch:
      for (v1::Job& job : *envelope->mutable_batch()->mutable_jobs()) on_job(&job);
      break;
    case v1::Envelope::kProblemReply:
      on_problem(envelope->mutable_problem_reply());
      break;
    case v1::Envelope::kCancel:
      for (std::uint64_t attempt : envelope->cancel().attempt_ids()) on_cancel(attempt);
      break;
    case v1::Envelope::kGoodbye:
      state_ = State::kDismissed;
      reason_ = envelope->goodbye().reason();
      drop_everything();
      break;
    default:
      break;  // a heartbeat says no more than that the master is there
  }
}

void WorkerSession::on_other_protocol(std::uint32_t protocol) {
  state_ = State::kRefused;
  reason_ = "the master speaks protocol " + std::to_string(protocol) + " and this worker " +
            std::to_string(kProtocol) + "; use the same build on both sides";
}

void WorkerSession::on_welcome(const v1::Welcome& welcome, double now) {
  if (welcome.epoch() != epoch_) drop_everything();  // nobody waits for it any more
  epoch_ = welcome.epoch();
  heartbeat_interval_ = std::clamp(welcome.heartbeat_interval(), 0.02, 60.0);
  silence_limit_ = std::max(welcome.silence_limit(), 2 * heartbeat_interval_);
  state_ = State::kWorking;
  hello_wait_ = 0;
  next_heartbeat_ = now + heartbeat_interval_;
}

void WorkerSession::on_job(v1::Job* job) {
  if (job->epoch() != epoch_ || epoch_ == 0) return;
  if (!in_hand_.emplace(job->attempt_id(), job->job_id()).second) return;  // told twice
  const std::string hash = job->problem_hash();
  if (hash.empty() || job->task().has_echo()) {
    ready(job, nullptr);
  } else if (auto problem = known_problem(hash)) {
    ready(job, std::move(problem));
  } else {
    std::vector<v1::Job>& waiting = parked_[hash];
    if (waiting.empty()) request_problem(hash);
    waiting.emplace_back().Swap(job);
  }
}

void WorkerSession::ready(v1::Job* job, std::shared_ptr<const std::string> problem) {
  Work& work = work_.emplace_back();
  work.job.Swap(job);
  work.problem = std::move(problem);
}

std::shared_ptr<const std::string> WorkerSession::known_problem(const std::string& hash) {
  const auto found = std::find_if(problems_.begin(), problems_.end(),
                                  [&](const KnownProblem& known) { return known.hash == hash; });
  if (found == problems_.end()) return nullptr;
  problems_.splice(problems_.begin(), problems_, found);
  return found->bytes;
}

void WorkerSession::request_problem(const std::string& hash) {
  outbox_.emplace_back().mutable_problem_request()->set_hash(hash);
}

void WorkerSession::on_problem(v1::ProblemReply* reply) {
  const auto parked = parked_.find(reply->hash());
  if (parked == parked_.end()) return;
  if (reply->problem().empty()) {
    answer_unknown(reply->hash());
    return;
  }
  // Damaged on the way: on_tick asks again.
  if (content_hash(reply->problem()) != reply->hash()) return;
  auto bytes = std::make_shared<const std::string>(std::move(*reply->mutable_problem()));
  problems_.push_front({reply->hash(), bytes});
  if (problems_.size() > kProblemsKept) problems_.pop_back();
  for (v1::Job& job : parked->second) ready(&job, bytes);
  parked_.erase(parked);
}

// What was handed on for work stays in hand until it is dropped or answered.
void WorkerSession::on_cancel(std::uint64_t attempt) {
  if (in_hand_.count(attempt) == 0) return;
  std::size_t erased =
      std::erase_if(work_, [&](const Work& work) { return work.job.attempt_id() == attempt; });
  for (auto& [hash, jobs] : parked_) {
    erased += std::erase_if(jobs, [&](const v1::Job& job) { return job.attempt_id() == attempt; });
  }
  std::erase_if(parked_, [](const auto& entry) { return entry.second.empty(); });
  if (erased > 0) {
    in_hand_.erase(attempt);
  } else {
    cancelled_.push_back({epoch_, attempt});
  }
}

void WorkerSession::on_dropped(const AttemptKey& key) {
  if (key.epoch == epoch_) in_hand_.erase(key.attempt);
}

void WorkerSession::answer_unknown(const std::string& hash) {
  const auto node = parked_.extract(hash);
  for (const v1::Job& job : node.mapped()) {
    v1::JobResult result;
    result.set_job_id(job.job_id());
    result.set_attempt_id(job.attempt_id());
    result.set_epoch(job.epoch());
    result.mutable_result()->set_outcome(v1::INVALID_REQUEST);
    result.mutable_result()->set_message("the master does not know the task's problem " + hash +
                                         "; add the problem before running its tasks");
    on_finished(std::move(result));
  }
}

void WorkerSession::on_finished(v1::JobResult result) {
  if (result.epoch() != epoch_ || in_hand_.count(result.attempt_id()) == 0) return;
  ++finished_;
  results_.push_back(std::move(result));
}

void WorkerSession::on_unsent(v1::Envelope* envelope) {
  if (!envelope->has_results()) return;  // the rest is said again in time
  auto& results = *envelope->mutable_results()->mutable_results();
  for (auto result = results.rbegin(); result != results.rend(); ++result) {
    in_hand_.emplace(result->attempt_id(), result->job_id());
    results_.push_front(std::move(*result));
  }
}

void WorkerSession::on_tick(double now) {
  if (state_ == State::kRefused || state_ == State::kDismissed) return;
  if (state_ == State::kWorking && now - last_heard_ > silence_limit_) state_ = State::kGreeting;
  if (state_ == State::kGreeting && now >= next_hello_) greet(now);
  if (epoch_ == 0 || now < next_heartbeat_) return;
  next_heartbeat_ = now + heartbeat_interval_;
  v1::Heartbeat* heartbeat = outbox_.emplace_back().mutable_heartbeat();
  heartbeat->set_sequence(++sequence_);
  heartbeat->set_jobs_in_hand(static_cast<std::uint32_t>(in_hand_.size()));
  heartbeat->set_finished(finished_);
  heartbeat->set_current_job_age(current_job_age_);
  heartbeat->set_epoch(epoch_);
  for (const auto& [attempt, job] : in_hand_) heartbeat->add_attempts(attempt);
  for (const auto& [hash, jobs] : parked_) request_problem(hash);
}

void WorkerSession::greet(double now) {
  hello_wait_ = std::clamp(2 * hello_wait_, options_.hello_min_s, options_.hello_max_s);
  next_hello_ = now + hello_wait_;
  v1::Hello* hello = outbox_.emplace_back().mutable_hello();
  hello->set_name(options_.name);
  hello->set_host(options_.host);
  hello->set_pid(options_.pid);
  hello->set_fingerprint(options_.fingerprint);
  hello->set_numeric_class(options_.numeric_class);
  hello->set_window(options_.window);
  hello->set_epoch(epoch_);
  for (const auto& [attempt, job] : in_hand_) hello->add_attempts(attempt);
  hello->set_replaces(options_.replaces);
  hello->set_replaced_end(options_.replaced_end);
}

void WorkerSession::drop_everything() {
  for (const auto& [attempt, job] : in_hand_) cancelled_.push_back({epoch_, attempt});
  in_hand_.clear();
  parked_.clear();
  work_.clear();
  results_.clear();
}

void WorkerSession::restart(double now) {
  state_ = State::kGreeting;
  epoch_ = 0;
  hello_wait_ = options_.hello_max_s / 2;
  next_hello_ = now + options_.hello_min_s;
}

std::vector<Work> WorkerSession::take_work() { return std::exchange(work_, {}); }

std::vector<AttemptKey> WorkerSession::take_cancelled() { return std::exchange(cancelled_, {}); }

double WorkerSession::next_tick() const {
  if (state_ == State::kWorking) return next_heartbeat_;
  return epoch_ == 0 ? next_hello_ : std::min(next_hello_, next_heartbeat_);
}

std::vector<v1::Envelope> WorkerSession::take_outbox() {
  while (!results_.empty()) {
    v1::ResultBatch* batch = outbox_.emplace_back().mutable_results();
    for (std::size_t bytes = 0; !results_.empty() && bytes < kResultBytes;) {
      v1::JobResult* result = batch->add_results();
      result->Swap(&results_.front());
      results_.pop_front();
      in_hand_.erase(result->attempt_id());
      bytes += result->ByteSizeLong();
    }
  }
  return std::exchange(outbox_, {});
}

v1::Envelope WorkerSession::goodbye(const std::string& reason) const {
  v1::Envelope envelope;
  envelope.mutable_goodbye()->set_reason(reason);
  return envelope;
}

}  // namespace gapfarm
