// The farm over ZeroMQ: local worker processes, remote workers, or both.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/net/envelope.h"
#include "common/net/socket.h"
#include "common/process/stop.h"
#include "master/farm/farm.h"
#include "master/farm/scheduler.h"

namespace gapfarm {

class PrivateFolder;

// Of the scheduler's the epoch counts lives of the master so far, below 2^24; the build's
// fingerprint is filled in.
struct SocketFarmOptions : SchedulerOptions {
  unsigned local_workers = 0;       // processes to start on this machine
  std::vector<std::string> listen;  // endpoints for workers that come by themselves
  LinkSecurity security;            // of tcp:// endpoints; without it they cannot be listened on
  LinkLimits limits;
  std::string worker_program;  // empty: find_worker_program()
  ProcessLimits local_limits;  // of the local workers; others have their own supervisors
  StopSource* stop = nullptr;  // ends stream(); not owned, outlives the farm
};

// Error: a problem too large for a message to a worker.
Status check_sendable(const v1::Problem& problem);

// Belongs to the thread that made it, which must live as long: the local workers die with it.
class SocketFarm : public Farm {
 public:
  // Listens and starts the local workers.  Errors: an endpoint that cannot be bound, no worker
  // program, neither local workers nor an endpoint.
  static Result<std::unique_ptr<SocketFarm>> create(SocketFarmOptions options);
  // Sends goodbye to all workers and ends the local ones.
  ~SocketFarm() override;

  std::string add_problem(const v1::Problem& problem) override;
  // Also fails when a task or the problem is larger than a message may be, and when every local
  // worker is gone for good and nobody else can come.
  Status stream(const std::string& problem_hash, std::vector<v1::Task> tasks,
                const TakeAnswer& take, const OnProgress& on_progress = {}) override;

  std::vector<WorkerStatus> workers() const override { return scheduler_->worker_status(); }
  std::vector<FleetStatus> fleets() const override { return scheduler_->fleet_status(); }
  std::vector<std::string> endpoints() const override { return endpoints_; }
  FarmTally tally() const override;
  std::uint64_t given_up() const override { return scheduler_->given_up(); }
  std::string numeric_class() const override { return scheduler_->workers().numeric_class(); }

  // Pids of the running local workers.
  std::vector<int> local_pids() const;

 private:
  explicit SocketFarm(SocketFarmOptions options);

  Status open();
  Status open_local();
  void on_event(const FarmEvent& event);
  void reap(double now);
  Status workers_can_be_had();
  void sleep(double now);
  Status loop(const TakeAnswer& take, const OnProgress& on_progress);
  // True: there are more tasks.
  Result<bool> hand_over(const TakeAnswer& take);

  SocketFarmOptions options_;
  // Ends in the reverse order: workers first, then the socket, then the folder it lives in.
  std::unique_ptr<PrivateFolder> folder_;
  std::unique_ptr<RouterSocket> socket_;
  std::unique_ptr<ProcessPool> locals_;
  std::unique_ptr<Scheduler> scheduler_;
  std::vector<std::string> endpoints_;
  std::string last_trouble_;                       // why workers do not come
  std::map<std::string, std::string> unsendable_;  // problems by hash: what is wrong
  double next_reap_ = 0;
  bool unanswered_ = false;  // what was asked last was stopped, or failed
};

// Handles what has arrived, lets the scheduler decide and sends what it decided.  True: something
// happened and more may be waiting; do not sleep yet.
bool pump(Transport& transport, Scheduler& scheduler, double now);

}  // namespace gapfarm
