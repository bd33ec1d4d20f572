#include "worker/session.h"

#include <algorithm>
#include <utility>

#include "common/base/hash.h"
#include "common/problem/problem.h"

namespace gapfarm {
namespace {

constexpr std::size_t kProblemsKept = 4;
constexpr std::size_t kResultBytes = std::size_t{1} << 20;  // a message of results
constexpr std::size_t kAnswersKept = 256;                   // for the next master
constexpr double kLongerThanLongest = 1.5;
constexpr double kUnheardWait = 0.25;  // s

// [0, 1), from the bits of `name` and a count: FNV-1a (Fowler, Noll and Vo).
double jitter(const std::string& name, std::uint64_t count) {
  std::uint64_t hash = 0xcbf29ce484222325u ^ count;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  hash = (hash ^ (hash >> 32)) * 0x9e3779b97f4a7c15u;
  return static_cast<double>(hash >> 11) * 0x1p-53;
}

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
      over_ = envelope->goodbye().over();
      drop_everything();
      // A master waits for this: what a connection brings is lost when it ends unread.
      outbox_.push_back(goodbye("the master has left"));
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
  if (welcome.epoch() != epoch_) drop_everything();  // nobody waits for it under these ids
  epoch_ = welcome.epoch();
  over_ = false;
  heartbeat_interval_ = std::clamp(welcome.heartbeat_interval(), 0.02, 60.0);
  silence_limit_ = std::max(welcome.silence_limit(), 2 * heartbeat_interval_);
  state_ = State::kWorking;
  hello_wait_ = 0;
  next_heartbeat_ = now + heartbeat_interval_;
  offer_kept();
}

void WorkerSession::on_job(v1::Job* job) {
  if (job->epoch() != epoch_ || epoch_ == 0) return;
  const auto [mine, fresh] = in_hand_.try_emplace(job->attempt_id());
  if (!fresh) return;  // sent twice
  if (leaving_ != Leaving::kNo) {
    on_dropped({epoch_, job->attempt_id()});
    return;
  }
  mine->second = {job->job_id(), question_hash(job->problem_hash(), job->task())};
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
  const auto found = std::ranges::find(problems_, hash, &KnownProblem::hash);
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
    on_dropped({epoch_, attempt});
  } else {
    cancelled_.push_back({epoch_, attempt});
  }
}

void WorkerSession::on_dropped(const AttemptKey& key) {
  std::erase_if(former_, [&](const Former& former) { return former.key == key; });
  if (key.epoch == epoch_ && in_hand_.erase(key.attempt) > 0) dropped_.push_back(key.attempt);
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
  longest_wall_ = std::max(longest_wall_, result.wall());
  if (result.epoch() == epoch_ && in_hand_.count(result.attempt_id()) != 0) {
    results_.push_back(std::move(result));
    return;
  }
  const AttemptKey key{result.epoch(), result.attempt_id()};
  const auto former = std::ranges::find(former_, key, &Former::key);
  if (former == former_.end()) return;
  keep(former->question, &result);
  former_.erase(former);
  if (state_ == State::kWorking) offer_kept();
}

void WorkerSession::on_unsent(v1::Envelope* envelope) {
  // Nobody is there.  Whoever is there next may be another master: first hear who it is.
  if (state_ == State::kWorking) {
    state_ = State::kGreeting;
    next_hello_ = 0;
  }
  // A hello that nobody got is no reason to wait longer with the next.
  if (envelope->has_hello()) hello_wait_ = std::min(hello_wait_, kUnheardWait);
  if (!envelope->has_results()) return;  // the rest is sent again in time
  auto& results = *envelope->mutable_results()->mutable_results();
  for (auto result = results.rbegin(); result != results.rend(); ++result) {
    in_hand_.insert(sending_.extract(result->attempt_id()));
    results_.push_front(std::move(*result));
  }
}

void WorkerSession::on_tick(double now) {
  if (state_ == State::kRefused || state_ == State::kDismissed) return;
  if (leaving_ == Leaving::kNo && too_late(now)) leave(Leaving::kAfterCurrent);
  if (state_ == State::kWorking && now - last_heard_ > silence_limit_) state_ = State::kGreeting;
  if (state_ == State::kGreeting && now >= next_hello_) greet(now);
  if (epoch_ == 0 || now < next_heartbeat_) return;
  next_heartbeat_ = now + heartbeat_interval_;
  v1::Heartbeat* heartbeat = outbox_.emplace_back().mutable_heartbeat();
  heartbeat->set_epoch(epoch_);
  heartbeat->set_leaving(leaving_ != Leaving::kNo);
  for (const auto& [attempt, job] : in_hand_) heartbeat->add_attempts(attempt);
  for (const auto& [hash, jobs] : parked_) request_problem(hash);
}

void WorkerSession::greet(double now) {
  hello_wait_ = std::clamp(2 * hello_wait_, options_.hello_min_s, options_.hello_max_s);
  next_hello_ = now + hello_wait_ * (1 + 0.5 * jitter(options_.hello.name(), ++hellos_));
  v1::Hello* hello = outbox_.emplace_back().mutable_hello();
  *hello = options_.hello;
  hello->set_epoch(epoch_);
  for (const auto& [attempt, job] : in_hand_) hello->add_attempts(attempt);
  hello->set_leaving(leaving_ != Leaving::kNo);
}

// The master that gave it out is gone.  What is done, or under way by now, may serve the next one.
void WorkerSession::drop_everything() {
  for (v1::JobResult& result : results_) {
    const auto mine = in_hand_.find(result.attempt_id());
    if (mine == in_hand_.end()) continue;
    keep(mine->second.question, &result);
    in_hand_.erase(mine);
  }
  for (const auto& [attempt, mine] : in_hand_) {
    cancelled_.push_back({epoch_, attempt});
    former_.push_back({{epoch_, attempt}, mine.question});
  }
  while (former_.size() > kAnswersKept) former_.pop_front();
  in_hand_.clear();
  parked_.clear();
  work_.clear();
  results_.clear();
  dropped_.clear();
}

void WorkerSession::keep(const std::string& question, v1::JobResult* result) {
  v1::Offer::Answer& answer = kept_.emplace_back();
  answer.set_question(question);
  answer.mutable_result()->Swap(result->mutable_result());
  if (kept_.size() > kAnswersKept) kept_.pop_front();
}

void WorkerSession::offer_kept() {
  while (!kept_.empty()) {
    v1::Offer* offer = outbox_.emplace_back().mutable_offer();
    for (std::size_t bytes = 0; !kept_.empty() && bytes < kResultBytes; kept_.pop_front()) {
      bytes += kept_.front().ByteSizeLong();
      offer->add_answers()->Swap(&kept_.front());
    }
  }
}

void WorkerSession::leave(Leaving how) {
  leaving_ = how;
  next_heartbeat_ = 0;  // send at once
  if (how == Leaving::kAfterCurrent) refuse_work();
}

// What has not been handed on for work yet.
void WorkerSession::refuse_work() {
  std::vector<std::uint64_t> attempts;
  for (const Work& work : work_) attempts.push_back(work.job.attempt_id());
  for (const auto& [hash, jobs] : parked_) {
    for (const v1::Job& job : jobs) attempts.push_back(job.attempt_id());
  }
  work_.clear();
  parked_.clear();
  for (std::uint64_t attempt : attempts) on_dropped({epoch_, attempt});
}

bool WorkerSession::too_late(double now) const {
  return now + kLongerThanLongest * longest_wall_ + options_.deadline_margin_s >
         options_.deadline_s;
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
  double next = epoch_ == 0 ? next_hello_ : next_heartbeat_;
  if (state_ != State::kWorking) next = std::min(next, next_hello_);
  return next;
}

std::vector<v1::Envelope> WorkerSession::take_outbox() {
  // Results are for the master that asked, and only a welcome says who is there.
  sending_.clear();
  while (state_ == State::kWorking && !results_.empty()) {
    v1::ResultBatch* batch = outbox_.emplace_back().mutable_results();
    for (std::size_t bytes = 0; !results_.empty() && bytes < kResultBytes;) {
      v1::JobResult* result = batch->add_results();
      result->Swap(&results_.front());
      sending_.insert(in_hand_.extract(result->attempt_id()));
      results_.pop_front();
      bytes += result->ByteSizeLong();
    }
  }
  if (state_ == State::kWorking && !dropped_.empty()) {
    v1::ResultBatch* batch = outbox_.emplace_back().mutable_results();
    batch->set_epoch(epoch_);
    batch->mutable_dropped()->Assign(dropped_.begin(), dropped_.end());
    dropped_.clear();
  }
  return std::exchange(outbox_, {});
}

v1::Envelope WorkerSession::goodbye(const std::string& reason) const {
  v1::Envelope envelope;
  envelope.mutable_goodbye()->set_reason(reason);
  return envelope;
}

bool pump_in(Transport& transport, WorkerSession& session, double now) {
  Message message;
  v1::Envelope envelope;
  bool any = false;
  while (transport.receive(&message)) {
    any = true;
    const DecodeStatus status = decode(message.bytes, &envelope);
    if (status == DecodeStatus::kOk) session.on_message(&envelope, now);
    if (status == DecodeStatus::kOtherProtocol) session.on_other_protocol(envelope.protocol());
  }
  return any;
}

void pump_out(Transport& transport, WorkerSession& session) {
  for (v1::Envelope& envelope : session.take_outbox()) {
    if (transport.send("", encode(&envelope)) != SendStatus::kSent) session.on_unsent(&envelope);
  }
}

}  // namespace gapfarm
