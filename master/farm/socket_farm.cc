#include "master/farm/socket_farm.h"

#include <algorithm>
#include <random>

#include "common/base/build_info.h"
#include "common/base/clock.h"
#include "common/problem/problem.h"
#include "master/farm/local_workers.h"

namespace gapfarm {

namespace {

constexpr double kProgressInterval = 0.1;  // s
constexpr double kReapInterval = 0.05;     // s, while messages keep the loop busy
// As long as a socket's last messages may take to get out (SocketOptions::linger_s).
constexpr double kFarewellLimit_s = 1;

// The count distinguishes the lives of one run, the random bits those of different runs that one
// worker serves one after the other: their counts, and so their attempt ids, may be the same.
std::uint64_t unique_epoch(std::uint64_t count) {
  std::random_device device;
  const std::uint64_t drawn = (std::uint64_t{device()} << 32 | device()) >> 24;
  return count << 40 | drawn | 1;
}

}  // namespace

SocketFarm::SocketFarm(SocketFarmOptions options) : options_(std::move(options)) {}

Result<std::unique_ptr<SocketFarm>> SocketFarm::create(SocketFarmOptions options) {
  std::unique_ptr<SocketFarm> farm(new SocketFarm(std::move(options)));
  RETURN_IF_ERROR(farm->open());
  return farm;
}

void SocketFarm::on_event(const FarmEvent& event) {
  if (event.kind == FarmEvent::kJoined && locals_) locals_->confirm(event.worker);
  if (event.kind == FarmEvent::kRefused) last_trouble_ = event.text;
  if (options_.on_event) options_.on_event(event);
}

Status SocketFarm::open() {
  if (options_.local_workers == 0 && options_.listen.empty()) {
    return Error{"the farm has no local workers and listens nowhere; give it one or the other"};
  }
  SchedulerOptions settings = options_;
  settings.epoch = unique_epoch(options_.epoch);
  settings.admittance.fingerprint = build_info().fingerprint;
  settings.on_event = [this](const FarmEvent& event) { on_event(event); };
  scheduler_ = std::make_unique<Scheduler>(std::move(settings));

  SocketOptions links;
  links.security = options_.security;
  links.limits = options_.limits;
  ASSIGN_OR_RETURN(socket_, RouterSocket::create(links));
  for (const std::string& endpoint : options_.listen) {
    ASSIGN_OR_RETURN(auto bound, socket_->bind(endpoint));
    endpoints_.push_back(bound);
  }
  return options_.local_workers > 0 ? open_local() : Status{};
}

Status SocketFarm::open_local() {
  ASSIGN_OR_RETURN(auto program, options_.worker_program.empty()
                                     ? find_worker_program()
                                     : Result<std::string>(options_.worker_program));
  ASSIGN_OR_RETURN(folder_, PrivateFolder::make());
  ASSIGN_OR_RETURN(auto endpoint, socket_->bind("ipc://" + folder_->socket_path()));
  locals_ = std::make_unique<ProcessPool>(
      local_worker_pool(program, options_.local_workers, endpoint, options_.local_limits));
  return locals_->start(monotonic_seconds());
}

void SocketFarm::reap(double now) {
  next_reap_ = now + kReapInterval;
  for (std::string& text : socket_->take_complaints()) {
    on_event({FarmEvent::kRefused, "", std::move(text), ""});
  }
  if (!locals_) return;
  for (const ProcessEnded& end : locals_->reap(now)) {
    scheduler_->on_process_end(end);
    if (end.gave_up) {
      if (last_trouble_.empty()) last_trouble_ = end.text;
      on_event({FarmEvent::kDied, end.name, end.text + "; it is not started again", ""});
    }
  }
}

Status SocketFarm::workers_can_be_had() {
  if (!options_.listen.empty() || !locals_ || !locals_->exhausted()) return {};
  return Error{"no worker can be had: " + last_trouble_};
}

void SocketFarm::sleep(double now) {
  std::vector<int> fds;
  if (locals_) fds = locals_->fds();
  if (options_.stop != nullptr) fds.push_back(options_.stop->fd());
  double until = now + std::min(options_.heartbeat_interval_s, kProgressInterval);
  if (locals_) {
    until = std::min({until, locals_->next_start(), now + locals_->look_interval()});
  }
  socket_->wait(fds, std::max(0.0, until - now));
}

namespace {

Status check_size(std::size_t size, const std::string& what, const char* remedy) {
  if (size <= kMaxMessageBytes / 2) return {};
  return Error{what + " has " + std::to_string(size) + " bytes and a message at most " +
               std::to_string(kMaxMessageBytes / 2) + "; " + remedy};
}

Status check(const std::vector<v1::Task>& tasks) {
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    RETURN_IF_ERROR(check_size(tasks[i].ByteSizeLong(), "task " + std::to_string(i), "split it"));
  }
  return {};
}

}  // namespace

Result<bool> SocketFarm::hand_over(const TakeAnswer& take) {
  std::vector<v1::Task> more;
  for (auto& [place, result] : scheduler_->take_answers()) {
    ASSIGN_OR_RETURN(auto next, take(place, std::move(result)));
    std::move(next.begin(), next.end(), std::back_inserter(more));
  }
  RETURN_IF_ERROR(check(more));
  const bool some = !more.empty();
  if (some) scheduler_->append(std::move(more));
  return some;
}

Status SocketFarm::loop(const TakeAnswer& take, const OnProgress& on_progress) {
  double next_progress = 0;
  bool busy = false;
  for (;;) {
    if (options_.stop != nullptr && options_.stop->requested()) return stop_requested();
    const double now = monotonic_seconds();
    if (!busy || now >= next_reap_) reap(now);
    busy = pump(*socket_, *scheduler_, now);
    ASSIGN_OR_RETURN(const bool more, hand_over(take));
    busy |= more;
    if (scheduler_->finished()) break;
    if (on_progress && now >= next_progress) {
      on_progress(scheduler_->progress());
      next_progress = now + kProgressInterval;
    }
    RETURN_IF_ERROR(workers_can_be_had());
    if (!busy) sleep(now);
  }
  if (on_progress) on_progress(scheduler_->progress());
  return {};
}

SocketFarm::~SocketFarm() {
  if (!socket_) return;  // open() failed before there was one
  const bool stopped = options_.stop != nullptr && options_.stop->requested();
  const bool over = !stopped && !unanswered_;
  scheduler_->send_goodbye(over ? "the run is over" : "the run was stopped", over);
  // A peer loses what it has not read when the connection ends, so that waits for their answers.
  const double until = monotonic_seconds() + kFarewellLimit_s;
  for (double now = 0; now < until; socket_->wait({}, std::max(0.0, until - now))) {
    now = monotonic_seconds();
    pump(*socket_, *scheduler_, now);
    if (scheduler_->goodbye_is_answered()) break;
  }
  if (locals_) end_local_workers(*locals_);
}

Status check_sendable(const v1::Problem& problem) {
  return check_size(problem.ByteSizeLong(), "the problem", "split the trial log or thin its paths");
}

std::string SocketFarm::add_problem(const v1::Problem& problem) {
  std::string bytes = serialise(problem);
  std::string hash = problem_hash(problem);
  if (Status s = check_sendable(problem); !s) unsendable_[hash] = s.error().message;
  scheduler_->add_problem(hash, std::move(bytes));
  return hash;
}

Status SocketFarm::stream(const std::string& problem_hash, std::vector<v1::Task> tasks,
                          const TakeAnswer& take, const OnProgress& on_progress) {
  if (const auto found = unsendable_.find(problem_hash); found != unsendable_.end()) {
    return Error{found->second};
  }
  RETURN_IF_ERROR(check(tasks));
  scheduler_->start(problem_hash, std::move(tasks));
  Status status = loop(take, on_progress);
  unanswered_ = !status;
  scheduler_->end();
  if (!status) pump(*socket_, *scheduler_, monotonic_seconds());
  return status;
}

FarmTally SocketFarm::tally() const {
  FarmTally tally = scheduler_->tally();
  const LinkCounts links = socket_->link_counts();
  tally.links = links.accepted;
  tally.refused_keys = links.refused_keys;
  tally.failed_handshakes = links.failed_handshakes;
  tally.dropped_links = links.dropped;
  return tally;
}

std::vector<int> SocketFarm::local_pids() const {
  return locals_ ? locals_->pids() : std::vector<int>{};
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
