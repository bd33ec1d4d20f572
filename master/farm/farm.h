// What the rest of the master sees of the farm: tasks in, results out, in the tasks' order.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "gapfarm/v1/problem.pb.h"
#include "gapfarm/v1/task.pb.h"

namespace gapfarm {

// Counts are workers.
struct FleetStatus {
  std::string name;
  std::string system;  // "slurm"
  std::string host;    // where it is managed
  unsigned wanted = 0, queued = 0, running = 0;
  std::uint64_t lost = 0;  // ended unasked before they had joined
  std::string why;         // not all that are wanted run; or empty
};

// Who a worker is, for whoever keeps its answers longer than it stays.
using WorkerId = std::uint64_t;

struct WorkerIdentity {
  WorkerId id = 0;
  std::string name;  // its own, unique: a process that replaces it has another
  std::string host;
  std::string numeric_class;
};

// How many workers each host has.
using HostCounts = std::map<std::string, unsigned>;

using WorkerIdentityPtr = std::shared_ptr<const WorkerIdentity>;

struct WorkerStatus {
  std::string name;
  std::string host;
  std::string state;  // "idle", "busy", "leaving", "gone"
  unsigned jobs = 0;  // in its hands
  std::uint64_t finished = 0;
  double rate_per_s = 0;  // jobs, since it joined
};

struct FarmProgress {
  std::size_t done = 0;
  std::size_t total = 0;
};

// What a farm went through.  Of a run: counted over all masters that have written to it.
struct FarmTally {
  std::uint64_t retries = 0, copies = 0, compared = 0, alarms = 0, hung = 0, handed_over = 0;
  std::uint64_t late = 0, foreign = 0, malformed = 0;
  std::uint64_t links = 0, refused_keys = 0, failed_handshakes = 0, dropped_links = 0;

  struct Row {
    const char* key;  // in the store and in status
    std::uint64_t FarmTally::*count;
    const char* label;  // for people
  };
  static const std::array<Row, 13> kRows;

  FarmTally& operator+=(const FarmTally& other) {
    for (const Row& row : kRows) this->*row.count += other.*row.count;
    return *this;
  }
};

inline constexpr std::array<FarmTally::Row, 13> FarmTally::kRows = {{
    {"retries", &FarmTally::retries, "retries: jobs given out again"},
    {"copies", &FarmTally::copies, "copies: jobs given to a second worker, the first took long"},
    {"compared", &FarmTally::compared, "audits and copies: answers held against another worker's"},
    {"alarms", &FarmTally::alarms, "alarms: those of them that differed"},
    {"hung", &FarmTally::hung, "workers killed because their simulation stood still"},
    {"handed_over", &FarmTally::handed_over,
     "answers that workers kept from one master to the next"},
    {"late", &FarmTally::late, "late: answers to jobs that had one"},
    {"foreign", &FarmTally::foreign, "foreign: answers to nothing that was asked"},
    {"malformed", &FarmTally::malformed, "malformed: messages that made no sense"},
    {"links", &FarmTally::links, "TCP connections"},
    {"refused_keys", &FarmTally::refused_keys, "of them refused: keys that are not listed"},
    {"failed_handshakes", &FarmTally::failed_handshakes, "of them failed: handshakes"},
    {"dropped_links", &FarmTally::dropped_links, "of them closed by the limits"},
}};

class Farm {
 public:
  virtual ~Farm() = default;

  // Makes a problem known to the farm; workers fetch it once.  Returns its hash.
  virtual std::string add_problem(const v1::Problem& problem) = 0;

  // Takes an answer by its task's place, counted over the call, and says what else to do.
  using TakeAnswer =
      std::function<Result<std::vector<v1::Task>>(std::size_t place, v1::TaskResult result)>;
  using OnProgress = std::function<void(const FarmProgress&)>;
  // Runs every task: each answer goes to `take` when it is there, in any order, and the tasks that
  // it returns are done, too.  `on_progress` (may be empty) is called now and then from this
  // thread.  Ends when nothing is left to do.  Errors: stopped by request, no worker can be had, or
  // `take`'s.
  virtual Status stream(const std::string& problem_hash, std::vector<v1::Task> tasks,
                        const TakeAnswer& take, const OnProgress& on_progress = {}) = 0;

  // The results in the tasks' order.
  Result<std::vector<v1::TaskResult>> run(const std::string& problem_hash,
                                          std::vector<v1::Task> tasks,
                                          const OnProgress& on_progress = {}) {
    std::vector<v1::TaskResult> results(tasks.size());
    const auto take = [&](std::size_t place, v1::TaskResult result) {
      results[place] = std::move(result);
      return Result<std::vector<v1::Task>>(std::vector<v1::Task>());
    };
    RETURN_IF_ERROR(stream(problem_hash, std::move(tasks), take, on_progress));
    return results;
  }

  virtual std::vector<WorkerStatus> workers() const { return {}; }
  // Those whose workers stand on clusters for it.
  virtual std::vector<FleetStatus> fleets() const { return {}; }
  // For workers, as bound: ports are filled in.
  virtual std::vector<std::string> endpoints() const { return {}; }
  virtual FarmTally tally() const { return {}; }
  virtual std::uint64_t given_up() const { return 0; }  // tasks
  // Of the run; empty before the first worker.
  virtual std::string numeric_class() const { return {}; }
};

// What stream() returns when a stop was requested; its code is kStopped.
inline Error stop_requested() { return {"stopped by request", ErrorCode::kStopped}; }

// To predict the ends of a problem's trials at a point; scores and covariances are dearer.
inline v1::Task prediction_task(const std::vector<v1::Override>& at, bool means_only) {
  v1::Task task;
  task.mutable_predict()->set_means_only(means_only);
  task.mutable_predict()->mutable_point()->mutable_overrides()->Assign(at.begin(), at.end());
  return task;
}
inline v1::Task prediction_task(const std::vector<double>& genome, bool means_only) {
  v1::Task task = prediction_task(std::vector<v1::Override>(), means_only);
  task.mutable_predict()->mutable_point()->mutable_genome()->Assign(genome.begin(), genome.end());
  return task;
}

// An error where `what` did not end well, with the `remedy`, if there is one.
inline Status ended_well(const v1::TaskResult& result, const std::string& what = "the simulation",
                         const std::string& remedy = "") {
  if (result.outcome() == v1::OK) return {};
  return Error{what + " ended with " + v1::Outcome_Name(result.outcome()) + " (" +
               result.message() + ")" + remedy};
}

}  // namespace gapfarm
