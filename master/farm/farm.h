// What the rest of the master sees of the farm: tasks in, results out, in the tasks' order.
#pragma once

#include <algorithm>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/base/try.h"
#include "gapfarm/v1/problem.pb.h"
#include "gapfarm/v1/task.pb.h"
#include "master/farm/sites/fleet_status.h"

namespace gapfarm {

struct WorkerStatus {
  std::string name;
  std::string host;
  std::string state;  // "idle", "busy", "leaving", "gone"
  unsigned jobs = 0;
  std::uint64_t finished = 0;
  double rate_per_s = 0;  // jobs, since it joined
};

struct FarmProgress {
  std::size_t done = 0;
  std::size_t total = 0;
};

class Farm {
 public:
  virtual ~Farm() = default;

  // Makes a problem known to the farm; workers fetch it once.  Returns its hash.
  virtual std::string add_problem(const v1::Problem& problem) = 0;

  // Runs every task and returns the results in the tasks' order.  `on_progress` (may be empty) is
  // called now and then from this thread.  Errors: stopped by request, or no worker can be had.
  virtual Result<std::vector<v1::TaskResult>> run(
      const std::string& problem_hash, const std::vector<v1::Task>& tasks,
      const std::function<void(const FarmProgress&)>& on_progress = {}) = 0;

  // Takes an answer by its task's place, counted over the call, and says what else to do.
  using TakeAnswer =
      std::function<Result<std::vector<v1::Task>>(std::size_t place, const v1::TaskResult& result)>;
  // As run(), but every answer goes to `take` when it is there, in any order, and the tasks that it
  // returns are done, too.  Ends when nothing is left to do, or with an error of `take`.
  virtual Status stream(const std::string& problem_hash, std::vector<v1::Task> tasks,
                        const TakeAnswer& take,
                        const std::function<void(const FarmProgress&)>& on_progress = {}) {
    for (std::size_t place = 0; !tasks.empty();) {
      ASSIGN_OR_RETURN(const auto results, run(problem_hash, tasks, on_progress));
      tasks.clear();
      for (const v1::TaskResult& result : results) {
        ASSIGN_OR_RETURN(auto more, take(place++, result));
        std::move(more.begin(), more.end(), std::back_inserter(tasks));
      }
    }
    return {};
  }

  virtual std::vector<WorkerStatus> workers() const = 0;
  // Those whose workers stand on clusters for it.
  virtual std::vector<FleetStatus> fleets() const { return {}; }
  // Jobs given out a second time because their worker went.
  virtual std::uint64_t retries() const = 0;
};

// What run() returns when a stop was requested; its code is kStopped.
inline Error stop_requested() { return {"stopped by request", ErrorCode::kStopped}; }

// An error where `what` did not end well, with the `remedy`, if there is one.
inline Status ended_well(const v1::TaskResult& result, const std::string& what = "the simulation",
                         const std::string& remedy = "") {
  if (result.outcome() == v1::OK) return {};
  return Error{what + " ended with " + v1::Outcome_Name(result.outcome()) + " (" +
               result.message() + ")" + remedy};
}

}  // namespace gapfarm
