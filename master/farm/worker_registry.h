// Who works for this master: admission, liveness, and what each worker holds.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "common/process/process_pool.h"
#include "gapfarm/v1/farm.pb.h"
#include "master/farm/farm.h"
#include "master/farm/job_queue.h"

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

struct WorkerRecord {
  WorkerId id = 0;
  std::string peer;  // transport's name of its connection
  std::string name;  // its own, unique
  std::string host;
  unsigned asked_window = 0;   // 0: the master's
  double last_heard = 0;       // s
  std::vector<Holding> holds;  // oldest first: a worker works in this order
  std::uint64_t finished = 0;
  double mean_wall = -1;  // s a task, lately; negative: unknown
  // Since when it may work on something that was taken back from it (infinity: it does not).  Until
  // it has said, long enough after, that its hands are empty, its death says nothing about one job.
  double doubtful_since = std::numeric_limits<double>::infinity();
  bool alone = false;    // the scheduler's: holds a suspect and gets nothing beside it
  bool in_line = false;  // the scheduler's: waits in line for jobs
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
  WorkerRecord* find_name(const std::string& name);
  WorkerRecord* find(WorkerId id);

  // Everybody from whom nothing came for longer than `limit` seconds.
  std::vector<WorkerId> silent_since(double now, double limit) const;
  // The master itself was away: nobody is to blame for its silence.
  void forgive(double now);

  // Forgets the worker; it stays in status() as gone.
  void remove(WorkerId id);

  std::size_t size() const { return workers_.size(); }
  const std::map<WorkerId, std::unique_ptr<WorkerRecord>>& all() const { return workers_; }
  const std::string& numeric_class() const { return admittance_.numeric_class; }
  std::vector<WorkerStatus> status() const;

 private:
  std::string refusal(const v1::Hello& hello) const;

  Admittance admittance_;
  WorkerId next_id_ = 1;
  std::map<WorkerId, std::unique_ptr<WorkerRecord>> workers_;
  std::unordered_map<std::string, WorkerRecord*> by_peer_;
  std::unordered_map<std::string, WorkerRecord*> by_name_;
  std::vector<WorkerStatus> gone_;  // the latest
};

}  // namespace gapfarm
