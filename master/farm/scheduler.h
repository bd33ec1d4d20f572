// The master's half of the protocol: fed with messages and a clock, it decides who works on what.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "master/farm/job_queue.h"
#include "master/farm/worker_registry.h"

namespace gapfarm {

// What a user may want to know; the farm goes on.
struct FarmEvent {
  enum Kind { kJoined, kReturned, kRefused, kLeft, kSilent, kDied, kQuarantined, kBadMessage };
  Kind kind;
  std::string worker;  // name; empty: unknown
  std::string text;    // a sentence
};

struct SchedulerOptions {
  std::uint64_t epoch = 1;  // of this life of the master; > 0
  Admittance admittance;
  JobLimits limits;
  unsigned window = 2;  // jobs in a worker's hand
  // Tasks shorter than a round trip need more in hand: as many as last so long, at most window_max.
  double window_s = 0.004;
  unsigned window_max = 256;
  double heartbeat_interval_s = 1;
  double silence_limit_s = 10;
  std::optional<std::uint64_t> shuffle_seed;
  std::function<void(const FarmEvent&)> on_event;
};

struct SchedulerCounts {
  std::uint64_t retries = 0;      // jobs that went back into the line
  std::uint64_t late = 0;         // answers to jobs that had one
  std::uint64_t foreign = 0;      // answers to nothing that was asked, or of another epoch
  std::uint64_t malformed = 0;    // messages that are no envelope, or not for a master
  std::uint64_t quarantined = 0;  // jobs
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

  // One batch at a time.
  void start(const std::string& problem_hash, std::vector<v1::Task> tasks);
  bool finished() const { return queue_.unfinished() == 0; }
  FarmProgress progress() const { return {queue_.committed(), queue_.total()}; }
  std::vector<v1::TaskResult> finish();  // REQUIRES: finished()
  void abandon();

  // Events.  `envelope` is left in a valid but unknown state.
  void on_message(const std::string& peer, v1::Envelope* envelope, double now);
  void on_malformed(const std::string& peer);
  void on_other_protocol(const std::string& peer, std::uint32_t protocol);
  // These messages did not go out: nobody is there, or does not take its messages any more.
  void on_unsent(const std::vector<Outgoing>& messages);
  void on_process_end(const std::string& name, EndCause cause, const std::string& text);
  // Gives out jobs, without judging anybody.
  void dispatch(double now);
  // Judges silence and gives out jobs.  Call when all messages that have arrived are handled: what
  // waits unread must not count as silence.
  void on_tick(double now);
  // Tells every worker that this master leaves.
  void say_goodbye(const std::string& reason);

  // To be sent by the caller, in order; cleared by it.
  std::vector<Outgoing>& outbox() { return outbox_; }

  const WorkerRegistry& workers() const { return registry_; }
  const SchedulerCounts& counts() const { return counts_; }

 private:
  void on_hello(const std::string& peer, const v1::Hello& hello, double now);
  void on_heartbeat(WorkerRecord& worker, const v1::Heartbeat& heartbeat, double now);
  void on_result(WorkerRecord& worker, v1::JobResult* result);
  void on_problem_request(const WorkerRecord& worker, const std::string& hash);
  // Gives back what the worker holds but `keeps`, if it holds it for longer than `grace`.
  template <class List>
  void keep_only(WorkerRecord& worker, const List& keeps, double held_since_before);
  void dismiss(WorkerRecord& worker, FarmEvent::Kind kind, const std::string& text);
  void cancel_all();
  void line_up(WorkerRecord& worker);
  std::size_t credit(const WorkerRecord& worker) const;

  v1::Envelope& post(const std::string& peer);
  void report(FarmEvent::Kind kind, const std::string& worker, const std::string& text) const;

  SchedulerOptions options_;
  WorkerRegistry registry_;
  JobQueue queue_;
  std::map<std::string, std::string> problems_;  // hash -> bytes
  std::deque<WorkerId> line_;                    // may take jobs
  struct Departed {
    WorkerId id;
    std::uint64_t attempt;
  };
  // What workers that went had in work, by name: how their processes ended may come out later.
  std::unordered_map<std::string, Departed> departed_;
  std::vector<Outgoing> outbox_;
  SchedulerCounts counts_;
  double last_tick_ = -1;
};

}  // namespace gapfarm
