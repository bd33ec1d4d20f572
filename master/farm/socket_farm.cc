#include "master/farm/socket_farm.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <random>

#include "common/base/build_info.h"
#include "common/base/clock.h"
#include "common/base/try.h"
#include "common/net/envelope.h"
#include "common/problem/problem.h"
#include "master/farm/local_workers.h"

namespace gapfarm {

namespace {

constexpr double kProgressInterval = 0.1;  // s
constexpr double kReapInterval = 0.05;     // s, while messages keep the loop busy
// As long as a socket's last messages may take to get out (SocketOptions::linger_s).
constexpr double kFarewellLimit_s = 1;

void complain(const FarmEvent& event) {
  switch (event.kind) {
    case FarmEvent::kJoined:
    case FarmEvent::kReturned:
    case FarmEvent::kLeft:
      return;
    default:
      std::fprintf(stderr, "gapfarm: %s%s\n",
                   event.worker.empty() ? "" : ("worker " + event.worker + ": ").c_str(),
                   event.text.c_str());
  }
}

// The count distinguishes the lives of one run, the random bits those of different runs that one
// worker serves one after the other: their counts, and so their attempt ids, may be the same.
std::uint64_t unique_epoch(std::uint64_t count) {
  std::random_device device;
  const std::uint64_t drawn = (std::uint64_t{device()} << 32 | device()) >> 24;
  return count << 40 | drawn | 1;
}

}  // namespace

struct SocketFarm::Impl {
  SocketFarmOptions options;
  // Ends in the reverse order: workers first, then the socket, then the folder it lives in.
  std::unique_ptr<PrivateFolder> folder;
  std::unique_ptr<RouterSocket> socket;
  std::unique_ptr<LocalWorkers> locals;
  std::unique_ptr<Scheduler> scheduler;
  std::vector<std::string> endpoints;
  std::string last_trouble;                       // why workers do not come
  std::map<std::string, std::string> unsendable;  // problems by hash: what is wrong
  double next_reap = 0;
  bool unanswered = false;  // what was asked last was stopped, or failed

  Status open();
  Status open_local();
  void on_event(const FarmEvent& event);
  void reap(double now);
  Status workers_can_be_had();
  void sleep(double now);
  Status check(const std::vector<v1::Task>& tasks) const;
  // `on_round` (may be empty) is called after messages were taken; true: there are more tasks.
  Status loop(const std::function<void(const FarmProgress&)>& on_progress,
              const std::function<Result<bool>()>& on_round);
  Result<std::vector<v1::TaskResult>> ask(
      const std::string& problem_hash, const std::vector<v1::Task>& tasks,
      const std::function<void(const FarmProgress&)>& on_progress,
      const std::function<Result<bool>()>& on_round = {});
};

void SocketFarm::Impl::on_event(const FarmEvent& event) {
  if (event.kind == FarmEvent::kJoined && locals) locals->pool().confirm(event.worker);
  if (event.kind == FarmEvent::kRefused) last_trouble = event.text;
  (options.on_event ? options.on_event : complain)(event);
}

Status SocketFarm::Impl::open() {
  if (options.local_workers == 0 && options.listen.empty()) {
    return Error{"the farm has no local workers and listens nowhere; give it one or the other"};
  }
  SchedulerOptions settings = options;
  settings.epoch = unique_epoch(options.epoch);
  settings.admittance.fingerprint = build_info().fingerprint;
  settings.on_event = [this](const FarmEvent& event) { on_event(event); };
  scheduler = std::make_unique<Scheduler>(std::move(settings));

  SocketOptions links;
  links.security = options.security;
  links.limits = options.limits;
  ASSIGN_OR_RETURN(auto made, RouterSocket::create(links));
  socket = std::move(made);
  for (const std::string& endpoint : options.listen) {
    ASSIGN_OR_RETURN(auto bound, socket->bind(endpoint));
    endpoints.push_back(bound);
  }
  return options.local_workers > 0 ? open_local() : Status{};
}

Status SocketFarm::Impl::open_local() {
  ASSIGN_OR_RETURN(auto program, options.worker_program.empty()
                                     ? find_worker_program()
                                     : Result<std::string>(options.worker_program));
  ASSIGN_OR_RETURN(auto made, PrivateFolder::make());
  folder = std::move(made);
  ASSIGN_OR_RETURN(auto endpoint, socket->bind("ipc://" + folder->socket_path()));
  locals = std::make_unique<LocalWorkers>(program, options.local_workers, endpoint,
                                          options.local_limits);
  return locals->start();
}

void SocketFarm::Impl::reap(double now) {
  next_reap = now + kReapInterval;
  for (std::string& text : socket->take_complaints()) {
    on_event({FarmEvent::kRefused, "", std::move(text), ""});
  }
  if (!locals) return;
  for (const ProcessEnded& end : locals->pool().reap(now)) {
    scheduler->on_process_end(end);
    if (end.gave_up) {
      if (last_trouble.empty()) last_trouble = end.text;
      on_event({FarmEvent::kDied, end.name, end.text + "; it is not started again", ""});
    }
  }
}

Status SocketFarm::Impl::workers_can_be_had() {
  if (!options.listen.empty() || !locals || !locals->pool().exhausted()) return {};
  return Error{"no worker can be had: " + last_trouble};
}

void SocketFarm::Impl::sleep(double now) {
  std::vector<int> fds;
  if (locals) fds = locals->pool().fds();
  if (options.stop != nullptr) fds.push_back(options.stop->fd());
  double until = now + std::min(options.heartbeat_interval_s, kProgressInterval);
  if (locals) {
    until = std::min({until, locals->pool().next_start(), now + locals->pool().look_interval()});
  }
  socket->wait(fds, std::max(0.0, until - now));
}

Status SocketFarm::Impl::loop(const std::function<void(const FarmProgress&)>& on_progress,
                              const std::function<Result<bool>()>& on_round) {
  double next_progress = 0;
  bool busy = false;
  for (;;) {
    if (options.stop != nullptr && options.stop->requested()) return stop_requested();
    const double now = monotonic_seconds();
    if (!busy || now >= next_reap) reap(now);
    busy = pump(*socket, *scheduler, now);
    if (on_round) {
      ASSIGN_OR_RETURN(const bool more, on_round());
      busy |= more;
    }
    if (scheduler->finished()) break;
    if (on_progress && now >= next_progress) {
      on_progress(scheduler->progress());
      next_progress = now + kProgressInterval;
    }
    RETURN_IF_ERROR(workers_can_be_had());
    if (!busy) sleep(now);
  }
  if (on_progress) on_progress(scheduler->progress());
  return {};
}

SocketFarm::SocketFarm(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::unique_ptr<SocketFarm>> SocketFarm::create(SocketFarmOptions options) {
  auto impl = std::make_unique<Impl>();
  impl->options = std::move(options);
  RETURN_IF_ERROR(impl->open());
  return std::unique_ptr<SocketFarm>(new SocketFarm(std::move(impl)));
}

SocketFarm::~SocketFarm() {
  const bool stopped = impl_->options.stop != nullptr && impl_->options.stop->requested();
  const bool over = !stopped && !impl_->unanswered;
  impl_->scheduler->send_goodbye(over ? "the run is over" : "the run was stopped", over);
  // A peer loses what it has not read when the connection ends, so that waits for their answers.
  const double until = monotonic_seconds() + kFarewellLimit_s;
  for (double now = 0; now < until; impl_->socket->wait({}, std::max(0.0, until - now))) {
    now = monotonic_seconds();
    pump(*impl_->socket, *impl_->scheduler, now);
    if (impl_->scheduler->goodbye_is_answered()) break;
  }
}

Status check_sendable(const v1::Problem& problem) {
  const std::size_t size = problem.ByteSizeLong();
  if (size <= kMaxMessageBytes / 2) return {};
  return Error{"the problem has " + std::to_string(size) + " bytes and a message at most " +
               std::to_string(kMaxMessageBytes / 2) + "; split the trial log or thin its paths"};
}

std::string SocketFarm::add_problem(const v1::Problem& problem) {
  std::string bytes = serialise(problem);
  std::string hash = problem_hash(problem);
  if (Status s = check_sendable(problem); !s) impl_->unsendable[hash] = s.error().message;
  impl_->scheduler->add_problem(hash, std::move(bytes));
  return hash;
}

Status SocketFarm::Impl::check(const std::vector<v1::Task>& tasks) const {
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const std::size_t size = tasks[i].ByteSizeLong();
    if (size <= kMaxMessageBytes / 2) continue;
    return Error{"task " + std::to_string(i) + " has " + std::to_string(size) +
                 " bytes and a message at most " + std::to_string(kMaxMessageBytes / 2) +
                 "; split it"};
  }
  return {};
}

Result<std::vector<v1::TaskResult>> SocketFarm::Impl::ask(
    const std::string& problem_hash, const std::vector<v1::Task>& tasks,
    const std::function<void(const FarmProgress&)>& on_progress,
    const std::function<Result<bool>()>& on_round) {
  if (const auto found = unsendable.find(problem_hash); found != unsendable.end()) {
    return Error{found->second};
  }
  RETURN_IF_ERROR(check(tasks));
  scheduler->start(problem_hash, tasks);
  const Status status = loop(on_progress, on_round);
  unanswered = !status;
  if (!status) {
    scheduler->abandon();
    pump(*socket, *scheduler, monotonic_seconds());
    return status.error();
  }
  return scheduler->finish();
}

Result<std::vector<v1::TaskResult>> SocketFarm::run(
    const std::string& problem_hash, const std::vector<v1::Task>& tasks,
    const std::function<void(const FarmProgress&)>& on_progress) {
  return impl_->ask(problem_hash, tasks, on_progress);
}

Status SocketFarm::stream(const std::string& problem_hash, std::vector<v1::Task> tasks,
                          const TakeAnswer& take,
                          const std::function<void(const FarmProgress&)>& on_progress) {
  const auto on_round = [&]() -> Result<bool> {
    std::vector<v1::Task> more;
    for (const auto& [place, result] : impl_->scheduler->take_answers()) {
      ASSIGN_OR_RETURN(auto next, take(place, result));
      std::move(next.begin(), next.end(), std::back_inserter(more));
    }
    RETURN_IF_ERROR(impl_->check(more));
    const bool some = !more.empty();
    if (some) impl_->scheduler->append(std::move(more));
    return some;
  };
  const auto results = impl_->ask(problem_hash, tasks, on_progress, on_round);
  return results ? Status() : Status(results.error());
}

void SocketFarm::watch_answers(AnswerWatcher watcher) {
  impl_->scheduler->watch_answers(std::move(watcher));
}

std::vector<WorkerStatus> SocketFarm::workers() const { return impl_->scheduler->worker_status(); }

std::vector<FleetStatus> SocketFarm::fleets() const { return impl_->scheduler->fleet_status(); }

std::vector<std::string> SocketFarm::endpoints() const { return impl_->endpoints; }

FarmTally SocketFarm::tally() const {
  FarmTally tally = impl_->scheduler->tally();
  const LinkCounts links = impl_->socket->link_counts();
  tally.links = links.accepted;
  tally.refused_keys = links.refused_keys;
  tally.failed_handshakes = links.failed_handshakes;
  tally.dropped_links = links.dropped;
  return tally;
}

std::uint64_t SocketFarm::given_up() const { return impl_->scheduler->given_up(); }

std::string SocketFarm::numeric_class() const {
  return impl_->scheduler->workers().numeric_class();
}

const std::deque<std::string>& SocketFarm::quarantine_reasons() const {
  return impl_->scheduler->quarantine_reasons();
}

std::vector<int> SocketFarm::local_pids() const {
  return impl_->locals ? impl_->locals->pool().pids() : std::vector<int>{};
}

namespace {

// Messages before the answers to them go out: sending pays off in bulk, waiting does not.
constexpr int kReceiveAtOnce = 256;

int receive_some(Transport& transport, Scheduler& scheduler, double now) {
  Message message;
  v1::Envelope envelope;
  int received = 0;
  while (received < kReceiveAtOnce && transport.receive(&message)) {
    ++received;
    switch (decode(message.bytes, &envelope)) {
      case DecodeStatus::kOk:
        scheduler.on_message(message.peer, &envelope, now);
        break;
      case DecodeStatus::kOtherProtocol:
        scheduler.on_other_protocol(message.peer, envelope.protocol());
        break;
      case DecodeStatus::kMalformed:
        scheduler.on_malformed(message.peer);
        break;
    }
  }
  return received;
}

// False: somebody was not there, and what it should have got waits again.
bool send_all(Transport& transport, Scheduler& scheduler) {
  std::vector<Outgoing> outgoing;
  outgoing.swap(scheduler.outbox());
  std::vector<Outgoing> unsent;
  for (Outgoing& out : outgoing) {
    if (transport.send(out.peer, encode(&out.envelope)) != SendStatus::kSent) {
      unsent.push_back(std::move(out));
    }
  }
  scheduler.on_unsent(unsent);
  return unsent.empty();
}

}  // namespace

bool pump(Transport& transport, Scheduler& scheduler, double now) {
  const int received = receive_some(transport, scheduler, now);
  if (received == kReceiveAtOnce) {
    // Too early to judge anybody's silence; but jobs go out, or the workers would idle.
    scheduler.dispatch(now);
  } else {
    scheduler.on_tick(now);
  }
  const bool sent = send_all(transport, scheduler);
  return received > 0 || !sent;
}

}  // namespace gapfarm
