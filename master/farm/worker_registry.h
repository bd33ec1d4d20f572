// Who works for this master: admission, liveness, and what each worker holds.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/process/process_pool.h"
#include "gapfarm/v1/farm.pb.h"
#include "master/farm/farm.h"

namespace gapfarm {

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

}  // namespace gapfarm
