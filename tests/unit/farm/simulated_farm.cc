#include "tests/unit/farm/simulated_farm.h"

#include <algorithm>
#include <cmath>

namespace gapfarm {

struct SimulatedFarm::Worker {
  std::string name;
  std::string peer;
  unsigned place = 0;
  bool alive = true;
  bool step_planned = false;
  double hung_until = 0;
  double cut_off_until = 0;
  std::unique_ptr<WorkerSession> session;
  std::unique_ptr<WorkerEnd> end;
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

struct SimulatedFarm::WorkerEnd : Transport {
  WorkerEnd(SimulatedFarm& owner, Worker& self) : farm(owner), worker(self) {}
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
    at(uniform(0, 0.05), [this, place] { start_worker(place, "", v1::PROCESS_LEFT); });
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
    const auto ends = {v1::PROCESS_LEFT, v1::PROCESS_KILLED};
    if (auto worker = any_worker()) end_worker(worker, *(ends.begin() + random_() % 2));
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
    scheduler_->start("", tasks_);
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
  options.heartbeat_interval_s = 0.1;
  options.silence_limit_s = 1;
  options.shuffle_seed = random_() % 2 ? std::optional<std::uint64_t>(random_()) : std::nullopt;
  scheduler_ = std::make_unique<Scheduler>(std::move(options));
  if (!master_end_) master_end_ = std::make_unique<MasterEnd>(*this);
}

void SimulatedFarm::start_worker(unsigned place, const std::string& replaces, v1::ProcessEnd end) {
  auto worker = std::make_shared<Worker>();
  worker->name = "worker-" + std::to_string(++names_);
  worker->peer = "peer-" + std::to_string(names_);
  worker->place = place;
  SessionOptions options;
  options.name = worker->name;
  options.fingerprint = "build";
  options.numeric_class = "class";
  options.replaces = replaces;
  options.replaced_end = end;
  worker->session = std::make_unique<WorkerSession>(std::move(options));
  worker->end = std::make_unique<WorkerEnd>(*this, *worker);
  places_[place] = worker;
  by_peer_[worker->peer] = worker;
  step_worker(worker);
}

// Sometimes the master's own child, whose end it sees; sometimes a remote one, of which it may hear
// from the replacement; sometimes a machine of which nobody ever hears again.
void SimulatedFarm::end_worker(const std::shared_ptr<Worker>& worker, v1::ProcessEnd end) {
  worker->alive = false;
  by_peer_.erase(worker->peer);
  const EndCause cause = end == v1::PROCESS_CRASHED  ? EndCause::kCrashed
                         : end == v1::PROCESS_KILLED ? EndCause::kKilled
                                                     : EndCause::kLeft;
  const bool local = chance(0.5);
  if (local) {
    at(now_ + uniform(0, 0.1),
       [this, worker, cause] { scheduler_->on_process_end(worker->name, cause, "ended"); });
  }
  const bool told = !local && (end == v1::PROCESS_CRASHED || chance(0.5));
  at(now_ + uniform(0, 0.5),
     [this, worker, told, end] { start_worker(worker->place, told ? worker->name : "", end); });
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
  pump_out(*worker->end, session);
  begin_next(worker);
  if (worker->step_planned) return;
  worker->step_planned = true;
  at(std::max(session.next_tick(), now_ + 1e-3), [this, worker] {
    worker->step_planned = false;
    step_worker(worker);
  });
}

void SimulatedFarm::begin_next(const std::shared_ptr<Worker>& worker) {
  if (worker->evaluating || worker->queue.empty()) return;
  worker->evaluating = true;
  const double wall = 1e-6 * static_cast<double>(worker->queue.front().job.task().echo().busy_us());
  at(std::max(now_, worker->hung_until) + wall, [this, worker, wall] {
    if (!worker->alive) return;
    const v1::Job job = std::move(worker->queue.front().job);
    worker->queue.pop_front();
    worker->evaluating = false;
    if (job.task().echo().payload() == "crash") {
      end_worker(worker, v1::PROCESS_CRASHED);
      return;
    }
    v1::JobResult result;
    result.set_job_id(job.job_id());
    result.set_attempt_id(job.attempt_id());
    result.set_epoch(job.epoch());
    result.set_wall(wall);
    result.mutable_result()->set_outcome(v1::OK);
    result.mutable_result()->set_echo(job.task().echo().payload());
    worker->session->on_finished(std::move(result));
    step_worker(worker);
  });
}

std::vector<v1::TaskResult> SimulatedFarm::run(const std::vector<v1::Task>& tasks, double limit_s) {
  tasks_ = tasks;
  scheduler_->start("", tasks);
  at(now_, [this] { master_clock(); });
  const double limit = now_ + limit_s;
  while (!scheduler_->finished() || now_ < faults_.span_s) {
    if (now_ > limit || events_.empty()) return {};
    Entry entry = events_.top();
    events_.pop();
    now_ = entry.time;
    entry.event();
  }
  return scheduler_->finish();
}

std::uint64_t SimulatedFarm::answers_taken() const {
  std::uint64_t taken = 0;
  for (const WorkerStatus& status : scheduler_->workers().status()) taken += status.finished;
  return taken;
}

}  // namespace gapfarm
