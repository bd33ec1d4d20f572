// How many workers to ask a cluster for: a function of what is to be done, of the jobs that stand,
// of limits and of a clock that is passed in.  No processes, no files, no sockets.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace gapfarm {

enum class JobState { kQueued, kRunning, kLeaving };  // leaving: it was asked to go

// One job of the cluster; it holds FleetLimits::workers_per_job workers.
struct FleetJob {
  std::string id;
  JobState state = JobState::kQueued;
  std::string node;     // empty: unknown
  double since_s = 0;   // it was submitted, or began to run
  bool joined = false;  // a worker of it has joined the master
  bool idle = false;    // no worker of it has a task
};

struct EndedJob {
  std::string id;
  std::string node;

  bool joined = false;   // a worker of it had joined the master
  bool ordered = false;  // it was asked to go
};

struct FleetLook {
  std::optional<std::uint64_t> unfinished;  // tasks without an answer; none: no master answers
  bool listed = true;                       // the cluster listed its jobs; else `jobs` is old
  std::vector<FleetJob> jobs;
  std::vector<EndedJob> ended;  // since the last look
};

struct FleetLimits {
  unsigned min_workers = 0;
  unsigned max_workers = 1;
  unsigned workers_per_job = 1;
  unsigned block = ~0u;      // jobs in one submission
  bool avoids_nodes = true;  // a submission can exclude nodes
  // Workers that are not needed for so long go.  Half of the minute that a worker may idle after
  // the last task; longer than the pause between two generations.
  double idle_s = 30;
  double backoff_s = 30;  // after a job that ended before a worker of it joined, then doubled
  double backoff_most_s = 3600;
  // A limit of the site that it showed by a refusal is tried again after so long: it may depend on
  // what else this user runs.
  double limit_memory_s = 600;
};

// What was learned in earlier looks.
class FleetMemory {
 public:
  // The site took, or refused for its limit on jobs, a submission of `jobs` while `standing` stood.
  // Refused once with fewer than stood before, the site waits as after a failure: HTCondor counts
  // jobs for a while that it lists no more.
  void note_accepted(unsigned jobs, unsigned standing);
  void note_site_limit(unsigned jobs, unsigned standing, const FleetLimits& limits, double now_s);
  // A submission failed for another reason.
  void note_failure(const FleetLimits& limits, double now_s) { strike("", limits, now_s); }

  // Jobs that the site allows, as far as it has shown.
  std::optional<unsigned> site_limit() const { return site_limit_; }

 private:
  friend struct FleetDecision decide(const FleetLook&, const FleetLimits&, double, FleetMemory*);
  struct Strikes {
    unsigned count = 0;
    double last_s = 0, until_s = 0;
  };
  void strike(const std::string& node, const FleetLimits& limits, double now_s);
  void learn(const FleetLook& look, const FleetLimits& limits, double now_s);
  unsigned demand(const FleetLook& look, const FleetLimits& limits, double now_s);

  std::map<std::string, Strikes> strikes_;  // by node; "": the whole site
  unsigned failures_ = 0;                   // in a row, since a job last began that joined
  double last_failure_s_ = 0;
  std::deque<std::pair<double, unsigned>> demand_;  // jobs wanted, lately: falling, by time
  std::optional<unsigned> site_limit_;
  double site_limit_until_s_ = 0;
  unsigned step_ = ~0u;         // jobs that the next submission tries
  unsigned growth_ = 0;         // of the limit while it is tried again; 0: it is not
  unsigned stood_ = 0;          // most jobs that the site has taken at once
  bool refused_fewer_ = false;  // the last submission was refused with fewer
};

struct FleetDecision {
  unsigned wanted = 0;              // jobs
  unsigned submit = 0;              // jobs
  std::vector<std::string> cancel;  // ids
  std::vector<std::string> avoid;   // nodes on which workers died at once
  std::string why;                  // fewer jobs than wanted stand and none is submitted; or empty
};

// Jobs that stand and are submitted are never more than limits.max_workers and the site's limit
// allow.  Without a master, or without a list, nothing changes.
FleetDecision decide(const FleetLook& look, const FleetLimits& limits, double now_s,
                     FleetMemory* memory);

}  // namespace gapfarm
