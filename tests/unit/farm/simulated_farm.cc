#include "tests/unit/farm/simulated_farm.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gapfarm {

struct SimulatedFarm::Worker {
  std::string name;
  std::string peer;
  unsigned place = 0;
  bool alive = true;
  bool step_planned = false;
  double hung_until = 0;
  double cut_off_until = 0;
  double deadline = std::numeric_limits<double>::infinity();
  std::unique_ptr<WorkerSession> session;
  std::unique_ptr<WorkerSide> end;
  std::deque<Work> queue;
  bool evaluating = false;
};

struct SimulatedFarm::MasterEnd : Transport {
  explicit MasterEnd(SimulatedFarm& owner) : farm(owner) {}
  SendStatus send(const std::string& peer, const std::string& bytes) override;
  bool receive(Message* message) override {
    if (inbox.empty()) return false;
    *message = std::move(inbox.front());
    inbox.pop_front();
    return true;
  }
  SimulatedFarm& farm;
  std::deque<Message> inbox;
};

struct SimulatedFarm::WorkerSide : Transport {
  WorkerSide(SimulatedFarm& owner, Worker& self) : farm(owner), worker(self) {}
  SendStatus send(const std::string&, const std::string& bytes) override {
    if (farm.now_ < worker.cut_off_until) return SendStatus::kSent;  // and lost
    farm.carry([&to = farm, peer = worker.peer, bytes] {  // may arrive after the sender's end
      to.master_end_->inbox.push_back({peer, bytes});
      to.step_master();
    });
    return SendStatus::kSent;
  }
  bool receive(Message* message) override {
    if (inbox.empty()) return false;
    message->bytes = std::move(inbox.front());
    inbox.pop_front();
    return true;
  }
  SimulatedFarm& farm;
  Worker& worker;
  std::deque<std::string> inbox;
};

SendStatus SimulatedFarm::MasterEnd::send(const std::string& peer, const std::string& bytes) {
  const auto found = farm.by_peer_.find(peer);
  if (found == farm.by_peer_.end()) return SendStatus::kUnreachable;
  const auto worker = found->second;
  if (farm.now_ < worker->cut_off_until) return SendStatus::kSent;  // and lost
  farm.carry([this, worker, bytes] {
    worker->end->inbox.push_back(bytes);
    farm.step_worker(worker);
  });
  return SendStatus::kSent;
}

SimulatedFarm::SimulatedFarm(std::uint64_t seed, unsigned workers, const FaultPlan& faults)
    : random_(seed), faults_(faults), places_(workers) {
  start_master();
  for (unsigned place = 0; place < workers; ++place) {
    at(uniform(0, 0.05), [this, place] { start_worker(place, {}); });
  }
  plan_faults(faults);
}

SimulatedFarm::~SimulatedFarm() = default;

double SimulatedFarm::uniform(double low, double high) {
  return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1p-53);
}

bool SimulatedFarm::chance(double probability) { return uniform(0, 1) < probability; }

void SimulatedFarm::at(double time, Event event) {
  events_.push({time, ++order_, std::move(event)});
}

void SimulatedFarm::carry(const Event& deliver) {
  const int copies = (chance(faults_.drop) ? 0 : 1) + (chance(faults_.duplicate) ? 1 : 0);
  for (int i = 0; i < copies; ++i) {
    // Never longer than half the silence limit: a link that holds messages back for longer is cut.
    at(now_ + std::min(0.5, -faults_.delay_s * std::log(1 - uniform(0, 1))), deliver);
  }
}

void SimulatedFarm::plan_faults(const FaultPlan& faults) {
  const auto times = [this, &faults](unsigned count, const Event& event) {
    for (unsigned i = 0; i < count; ++i) at(uniform(0, faults.span_s), event);
  };
  times(faults.deaths, [this] {
    const auto ends = {EndCause::kLeft, EndCause::kKilled};
    if (auto worker = any_worker()) end_worker(worker, *(ends.begin() + random_() % 2));
  });
  times(faults.drains, [this] {
    auto worker = any_worker();
    if (!worker || now_ < worker->hung_until) return;
    worker->session->leave(chance(0.5) ? WorkerSession::Leaving::kAfterAll
                                       : WorkerSession::Leaving::kAfterCurrent);
    step_worker(worker);
  });
  times(faults.hangs, [this] {
    auto worker = any_worker();
    if (!worker) return;
    worker->hung_until = now_ + uniform(0, 3);
    at(worker->hung_until, [this, worker] { step_worker(worker); });
  });
  times(faults.partitions, [this] {
    if (auto worker = any_worker()) worker->cut_off_until = now_ + uniform(0, 3);
  });
  times(faults.master_pauses, [this] { master_away_until_ = now_ + uniform(0, 3); });
  times(faults.master_restarts, [this] {
    start_master();
    scheduler_->start("", batch_);
    taken_before_ = 0;
  });
}

std::shared_ptr<SimulatedFarm::Worker> SimulatedFarm::any_worker() {
  const auto worker = places_[random_() % places_.size()];
  return worker && worker->alive ? worker : nullptr;
}

void SimulatedFarm::start_master() {
  SchedulerOptions options;
  options.epoch = ++epoch_;
  options.admittance = {"build", "class", false};
  options.heartbeat_interval_s = faults_.heartbeat_s;
  options.silence_limit_s = 10 * faults_.heartbeat_s;
  options.copies.audit_share = faults_.audit_share;
  options.window = faults_.window;
  options.on_event = [this](const FarmEvent& event) {
    if (event.kind == FarmEvent::kDisagreement || event.kind == FarmEvent::kQuarantined) {
      alarms_.push_back(event);
    }
  };
  options.shuffle_seed = random_() % 2 ? std::optional<std::uint64_t>(random_()) : std::nullopt;
  scheduler_ = std::make_unique<Scheduler>(std::move(options));
  if (!master_end_) master_end_ = std::make_unique<MasterEnd>(*this);
}

void SimulatedFarm::start_worker(unsigned place, const ProcessEnded& replaced) {
  auto worker = std::make_shared<Worker>();
  worker->name = "worker-" + std::to_string(++names_);
  worker->peer = "peer-" + std::to_string(names_);
  worker->place = place;
  if (faults_.lifetime_s > 0) worker->deadline = now_ + faults_.lifetime_s * uniform(0.5, 1.5);
  SessionOptions options;
  options.hello.set_name(worker->name);
  options.hello.set_host("host-" + std::to_string(place / 2));
  options.hello.set_fingerprint("build");
  options.hello.set_numeric_class("class");
  options.hello.set_replaces(replaced.name);
  options.hello.set_replaced_end(static_cast<std::uint32_t>(replaced.cause));
  options.hello.set_replaced_epoch(replaced.epoch);
  options.hello.set_replaced_attempt(replaced.attempt);
  options.deadline_s = worker->deadline;
  options.deadline_margin_s = 0.01;
  worker->session = std::make_unique<WorkerSession>(std::move(options));
  worker->end = std::make_unique<WorkerSide>(*this, *worker);
  places_[place] = worker;
  by_peer_[worker->peer] = worker;
  step_worker(worker);
}

// Sometimes the master's own child, whose end it sees; sometimes a remote one, of which it may hear
// from the replacement; sometimes a machine of which nobody ever hears again.
void SimulatedFarm::end_worker(const std::shared_ptr<Worker>& worker, EndCause cause) {
  worker->alive = false;
  by_peer_.erase(worker->peer);
  ProcessEnded end;
  end.name = worker->name;
  end.cause = cause;
  end.text = "ended";
  if (worker->evaluating) {
    end.epoch = worker->queue.front().job.epoch();
    end.attempt = worker->queue.front().job.attempt_id();
  }
  const bool local = chance(0.5);
  if (local) at(now_ + uniform(0, 0.1), [this, end] { scheduler_->on_process_end(end); });
  const bool own_doing = cause == EndCause::kCrashed || cause == EndCause::kHung;
  const bool reported = !local && (own_doing || chance(0.5));
  at(now_ + uniform(0, 0.5), [this, worker, reported, end] {
    start_worker(worker->place, reported ? end : ProcessEnded{});
  });
}

void SimulatedFarm::step_master() {
  if (now_ < master_away_until_) return;
  while (pump(*master_end_, *scheduler_, now_)) {
  }
}

void SimulatedFarm::master_clock() {
  step_master();
  at(now_ + 0.1, [this] { master_clock(); });
}

void SimulatedFarm::step_worker(const std::shared_ptr<Worker>& worker) {
  if (!worker->alive || now_ < worker->hung_until) return;
  WorkerSession& session = *worker->session;
  pump_in(*worker->end, session, now_);
  session.on_tick(now_);
  for (const AttemptKey& key : session.take_cancelled()) {
    const auto unwanted = [&key](const Work& work) {
      return work.job.epoch() == key.epoch && work.job.attempt_id() == key.attempt;
    };
    // The first may have begun.
    const auto first = worker->queue.begin() + (worker->evaluating ? 1 : 0);
    if (first > worker->queue.end()) continue;
    const auto kept = std::remove_if(first, worker->queue.end(), unwanted);
    if (kept != worker->queue.end()) session.on_dropped(key);
    worker->queue.erase(kept, worker->queue.end());
  }
  for (Work& work : session.take_work()) worker->queue.push_back(std::move(work));
  if (session.leaving() == WorkerSession::Leaving::kAfterCurrent) drop_work(*worker);
  begin_next(worker);
  pump_out(*worker->end, session);
  if (leaves(worker)) return;
  if (worker->step_planned) return;
  worker->step_planned = true;
  at(std::max(session.next_tick(), now_ + 1e-3), [this, worker] {
    worker->step_planned = false;
    step_worker(worker);
  });
}

void SimulatedFarm::drop_work(Worker& worker) {
  while (worker.queue.size() > (worker.evaluating ? 1u : 0u)) {
    const v1::Job& job = worker.queue.back().job;
    worker.session->on_dropped({job.epoch(), job.attempt_id()});
    worker.queue.pop_back();
  }
}

// As worker/service.cc does.
bool SimulatedFarm::leaves(const std::shared_ptr<Worker>& worker) {
  const WorkerSession& session = *worker->session;
  const auto leaving = session.leaving();
  const bool empty = leaving == WorkerSession::Leaving::kAfterCurrent ||
                     session.state() != WorkerSession::State::kWorking || session.in_hand() == 0;
  const bool done = leaving != WorkerSession::Leaving::kNo && !worker->evaluating && empty;
  if (!done && now_ < worker->deadline) return false;
  v1::Envelope goodbye = session.goodbye("no time left");
  worker->end->send("", encode(&goodbye));
  end_worker(worker, EndCause::kLeft);
  return true;
}

void SimulatedFarm::begin_next(const std::shared_ptr<Worker>& worker) {
  if (worker->evaluating || worker->queue.empty()) return;
  worker->evaluating = true;
  const v1::EchoTask& task = worker->queue.front().job.task().echo();
  if (task.payload() == "hang") {
    at(now_ + faults_.progress_s, [this, worker] {
      if (worker->alive) end_worker(worker, EndCause::kHung);
    });
    return;
  }
  const double wall = 1e-6 * static_cast<double>(task.busy_us());
  at(std::max(now_, worker->hung_until) + wall, [this, worker, wall] {
    if (worker->alive) finish_task(worker, wall);
  });
}

void SimulatedFarm::finish_task(const std::shared_ptr<Worker>& worker, double wall) {
  const std::string& payload = worker->queue.front().job.task().echo().payload();
  if (payload == "crash") {
    end_worker(worker, EndCause::kCrashed);
    return;
  }
  const v1::Job job = std::move(worker->queue.front().job);
  worker->queue.pop_front();
  worker->evaluating = false;
  v1::JobResult result;
  result.set_job_id(job.job_id());
  result.set_attempt_id(job.attempt_id());
  result.set_epoch(job.epoch());
  result.set_wall(wall);
  result.mutable_result()->set_outcome(v1::OK);
  result.mutable_result()->set_echo(job.task().echo().payload());
  if (worker->place == corrupt_) result.mutable_result()->set_echo("wrong");
  if (chance(faults_.mistaken)) result.set_job_id(job.job_id() + 1);
  worker->session->on_finished(std::move(result));
  step_worker(worker);
}

// The next event; false: nothing will ever happen.
bool SimulatedFarm::step() {
  if (events_.empty()) return false;
  const Entry entry = events_.top();
  events_.pop();
  now_ = entry.time;
  entry.event();
  return true;
}

bool SimulatedFarm::stream(std::vector<v1::Task> tasks, const Farm::TakeAnswer& take,
                           double limit_s) {
  at(now_, [this] { master_clock(); });
  const double limit = now_ + limit_s;
  scheduler_->start("", std::move(tasks));
  while (!scheduler_->finished()) {
    if (now_ > limit || !step()) return false;
    std::vector<v1::Task> more;
    for (auto& [place, result] : scheduler_->take_answers()) {
      auto next = take(place, std::move(result));
      if (!next) return false;
      std::move(next->begin(), next->end(), std::back_inserter(more));
    }
    if (more.empty()) continue;
    scheduler_->append(std::move(more));
    step_master();
  }
  scheduler_->end();
  return true;
}

std::vector<v1::TaskResult> SimulatedFarm::run(const std::vector<v1::Task>& tasks,
                                               std::size_t batches, double limit_s) {
  std::vector<v1::TaskResult> all;
  at(now_, [this] { master_clock(); });
  const double limit = now_ + limit_s;
  for (std::size_t b = 0; b < batches; ++b) {
    const auto from = static_cast<std::ptrdiff_t>(b * tasks.size() / batches);
    const auto to = static_cast<std::ptrdiff_t>((b + 1) * tasks.size() / batches);
    batch_.assign(tasks.begin() + from, tasks.begin() + to);
    taken_before_ = taken();
    scheduler_->start("", batch_);
    const bool last = b + 1 == batches;
    while (!scheduler_->finished() || (last && now_ < faults_.span_s)) {
      if (now_ > limit || !step()) return {};
    }
    const std::size_t before = all.size();
    all.resize(before + batch_.size());
    for (auto& [place, result] : scheduler_->take_answers())
      all[before + place] = std::move(result);
    scheduler_->end();
  }
  return all;
}

std::uint64_t SimulatedFarm::taken() const {
  std::uint64_t taken = scheduler_->tally().handed_over + scheduler_->given_up();
  for (const WorkerStatus& status : scheduler_->worker_status()) taken += status.finished;
  return taken;
}

}  // namespace gapfarm
