// The master's half of the protocol: fed with messages and a clock, it decides who works on what.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/process/process_pool.h"
#include "gapfarm/v1/farm.pb.h"
#include "master/farm/farm.h"
#include "master/farm/job_queue.h"

namespace gapfarm {

// Who works for this master: admission, liveness, and what each worker holds.

struct Admittance {
  std::string fingerprint;    // of the build; a worker of another is refused
  std::string numeric_class;  // of the run; empty: the first worker's
  bool allow_mixed_numeric_classes = false;
};

struct Holding {
  std::uint64_t attempt = 0;
  double since = 0;  // s, dispatch
};

struct WorkerRecord : WorkerIdentity, std::enable_shared_from_this<WorkerRecord> {
  std::string peer;            // transport's name of its connection
  unsigned asked_window = 0;   // 0: the master's
  double last_heard = 0;       // s
  std::vector<Holding> holds;  // oldest first: a worker works in this order
  std::uint64_t finished = 0;
  double mean_wall = -1;  // s a task, lately; negative: unknown
  double turnaround = 0;  // s between a task's dispatch and its answer, lately
  bool leaving = false;   // takes no more jobs
  double joined = 0;      // s
  bool in_line = false;   // the scheduler's: waits in line for jobs
};

// Times are seconds of the caller's clock.
class WorkerRegistry {
 public:
  explicit WorkerRegistry(Admittance admittance) : admittance_(std::move(admittance)) {}

  struct Admission {
    WorkerRecord* worker = nullptr;  // null: refused
    bool returning = false;          // known by name: keeps its id and what it holds
    std::string refusal;             // names both sides' values and the remedy
  };
  Admission admit(const std::string& peer, const v1::Hello& hello, double now);

  WorkerRecord* find_peer(const std::string& peer);
  WorkerRecord* find_name(const std::string& name) const;
  WorkerRecord* find(WorkerId id);
  // As `worker` is now, for as long as somebody needs to know.
  static WorkerIdentityPtr identity(const WorkerRecord& worker) {
    return worker.shared_from_this();
  }
  const HostCounts& hosts() const { return hosts_; }

  // Everybody from whom nothing came for longer than `limit` seconds.
  std::vector<WorkerId> silent_since(double now, double limit) const;
  // The master itself was away: nobody is to blame for its silence.
  void forgive(double now);

  // Forgets the worker; it stays in status() as gone.
  void remove(WorkerId id);

  std::size_t size() const { return workers_.size(); }
  const std::map<WorkerId, std::shared_ptr<WorkerRecord>>& all() const { return workers_; }
  const std::string& numeric_class() const { return admittance_.numeric_class; }
  std::vector<WorkerStatus> status(double now) const;

 private:
  std::string refusal(const v1::Hello& hello) const;

  Admittance admittance_;
  WorkerId next_id_ = 1;
  std::map<WorkerId, std::shared_ptr<WorkerRecord>> workers_;
  HostCounts hosts_;
  std::unordered_map<std::string, WorkerRecord*> by_peer_;
  std::unordered_map<std::string, WorkerRecord*> by_name_;
  std::vector<WorkerStatus> gone_;  // the latest
};

// Times are seconds of the caller's clock.
class FleetRegistry {
 public:
  // False: this is no fleet's report, or there are too many fleets.
  bool hear(const std::string& peer, const v1::Fleet& report, double now);
  // Of those that were heard of lately.
  std::vector<FleetStatus> status(double now) const;
  std::vector<std::string> peers() const;

 private:
  struct Heard {
    std::string peer;
    FleetStatus status;
    double at = 0;
  };
  std::map<std::string, Heard> fleets_;  // by name
};

// What a user may want to know; the farm goes on.
struct FarmEvent {
  enum Kind {
    kJoined,
    kReturned,
    kRefused,
    kLeft,
    kSilent,
    kDied,
    kQuarantined,
    kDisagreement,
    kBadMessage
  };
  Kind kind;
  std::string worker;  // name; empty: unknown
  std::string text;    // a sentence
  std::string host;    // the worker's; empty: unknown
};

// One job on its way; for logs.
struct JobEvent {
  bool answered = false;  // else given out
  std::uint64_t job = 0;
  std::uint64_t attempt = 0;
  const std::string& worker;
  const std::string& host;
};

struct SchedulerOptions {
  std::uint64_t epoch = 1;  // of this life of the master; > 0
  Admittance admittance;
  JobLimits job_limits;
  CopyOptions copies;
  unsigned window = 2;  // jobs in a worker's hand
  // Tasks shorter than a round trip need more in hand: as many as last so long, at most window_max.
  // `window_s` is a round trip on an idle machine; what longer ones need is measured, worker by
  // worker.
  double window_s = 0.004;
  double window_most_s = 0.05;  // half of what makes a straggler (CopyOptions)
  unsigned window_max = 256;
  double heartbeat_interval_s = 1;
  double silence_limit_s = 10;
  std::optional<std::uint64_t> shuffle_seed;
  std::function<void(const FarmEvent&)> on_event;
  std::function<void(const JobEvent&)> on_job;  // may be empty
};

struct Outgoing {
  std::string peer;
  v1::Envelope envelope;
};

// Times are seconds of one monotonic clock that the caller reads.  No sockets, no threads.
class Scheduler {
 public:
  explicit Scheduler(SchedulerOptions options);

  void add_problem(const std::string& hash, std::string bytes) {
    problems_[hash] = std::move(bytes);
  }

  // One batch at a time, which append() may make longer; see JobQueue.
  void start(const std::string& problem_hash, std::vector<v1::Task> tasks);
  void append(std::vector<v1::Task> tasks) {
    queue_.append(std::move(tasks), options_.shuffle_seed);
  }
  std::vector<std::pair<std::size_t, v1::TaskResult>> take_answers() {
    return queue_.take_answers();
  }
  bool finished() const { return queue_.unfinished() == 0; }
  FarmProgress progress() const { return {queue_.committed(), queue_.total()}; }
  void end();

  // Events.  `envelope` is left in a valid but unknown state.
  void on_message(const std::string& peer, v1::Envelope* envelope, double now);
  void on_malformed(const std::string& peer);
  void on_other_protocol(const std::string& peer, std::uint32_t protocol);
  // These messages did not go out: nobody is there, or does not take its messages any more.
  void on_unsent(const std::vector<Outgoing>& messages);
  void on_process_end(const ProcessEnded& end);
  // Gives out jobs, without judging anybody.
  void dispatch(double now);
  // Judges silence and gives out jobs.  Call when all messages that have arrived are handled: what
  // waits unread must not count as silence.
  void on_tick(double now);
  // Informs every worker and fleet that this master leaves; from then on only their answers count.
  void send_goodbye(const std::string& reason, bool over);
  // All have answered the goodbye, or are gone.
  bool goodbye_is_answered() const { return unanswered_.empty(); }

  // To be sent by the caller, in order; cleared by it.
  std::vector<Outgoing>& outbox() { return outbox_; }

  const WorkerRegistry& workers() const { return registry_; }
  std::vector<WorkerStatus> worker_status() const { return registry_.status(last_tick_); }
  std::vector<FleetStatus> fleet_status() const { return fleets_.status(last_tick_); }
  FarmTally tally() const;                              // but for the links
  std::uint64_t given_up() const { return given_up_; }  // jobs

 private:
  void on_hello(const std::string& peer, const v1::Hello& hello, double now);
  void greet(const WorkerRecord& worker, bool returning, double now);
  void on_fleet(const std::string& peer, const v1::Fleet& fleet, double now);
  void on_heartbeat(WorkerRecord& worker, const v1::Heartbeat& heartbeat, double now);
  // False: the worker is gone with it.
  bool on_result(WorkerRecord& worker, v1::JobResult* result, double now);
  void on_dropped(WorkerRecord& worker, const v1::ResultBatch& batch);
  void on_offer(WorkerRecord& worker, v1::Offer* offer);
  void on_committed(const Committed& committed);
  void take_offers();
  void on_problem_request(const WorkerRecord& worker, const std::string& hash);
  // Gives back what the worker holds but `keeps`, if it holds it for longer than `grace`.
  template <class List>
  void keep_only(WorkerRecord& worker, const List& keeps, double held_since_before);
  std::string values_of_task(const v1::Task& task) const;
  void refuse(WorkerRecord& worker, FarmEvent::Kind kind, const std::string& reason);
  void dismiss(WorkerRecord& worker, FarmEvent::Kind kind, const std::string& text);
  void cancel_all();
  void cancel(const Losers& losers);
  void line_up(WorkerRecord& worker);
  std::size_t credit(const WorkerRecord& worker) const;
  class Batches;
  void dispatch_line(double now, Batches& batches);
  void dispatch_stragglers(double now, Batches& batches);

  v1::Envelope& post(const std::string& peer);
  void report(FarmEvent::Kind kind, const std::string& worker, const std::string& text) const;

  SchedulerOptions options_;
  WorkerRegistry registry_;
  FleetRegistry fleets_;
  JobQueue queue_;
  std::map<std::string, std::string> problems_;  // hash -> bytes
  std::deque<WorkerId> line_;                    // may take jobs
  // Workers that went, by name: how their processes ended may come out later.
  std::unordered_map<std::string, WorkerIdentityPtr> departed_;
  // Workers that were dismissed for silence, by name: since when it lasted.
  std::unordered_map<std::string, double> silenced_;
  struct Offered {
    WorkerIdentityPtr by;
    v1::Offer::Answer answer;
  };
  std::deque<Offered> offers_;  // that came between batches
  std::vector<Outgoing> outbox_;
  FarmTally tally_;
  std::uint64_t given_up_ = 0;
  double last_tick_ = -1;
  bool leaving_ = false;
  std::set<std::string> unanswered_;  // peers that have not answered the goodbye
};

}  // namespace gapfarm
