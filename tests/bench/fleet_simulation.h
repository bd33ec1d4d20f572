// A cluster and a master under a virtual clock, to judge the autoscaler: queue waits, wall times,
// pre-emption, bad nodes and a limit on jobs are drawn from distributions.
#pragma once

#include <cstdint>
#include <vector>

#include "master/farm/sites/fleet.h"

namespace gapfarm {

struct FleetScenario {
  std::uint64_t seed = 1;
  FleetLimits limits;
  double look_interval_s = 15;
  // Work: batches one after the other, with pauses in which the master has nothing to give.
  std::vector<std::uint64_t> batches;  // tasks
  double pause_s = 0;
  double task_s = 60;            // mean; gamma with shape 4
  double queue_wait_s = 60;      // median; log-normal with sigma 1
  double start_s = 5;            // from a job's start to its workers' first tasks
  double wall_time_s = 3600;     // of a job
  double preempted_after_s = 0;  // mean of an exponential; 0: never
  unsigned nodes = 1000;
  double bad_nodes = 0;       // share; jobs end there after a second
  unsigned site_limit = ~0u;  // jobs
};

struct FleetMoment {
  double at_s = 0;
  unsigned wanted = 0, queued = 0, running = 0;  // workers
};

struct FleetOutcome {
  double paid_s = 0;    // worker-seconds of all jobs that ran
  double oracle_s = 0;  // of who knows the future: tasks, and the starts that wall times demand
  double span_s = 0;    // until the last answer
  unsigned most_workers = 0;  // at any time, queued ones included
  unsigned submissions = 0, refusals = 0, jobs = 0, quick_ends = 0, preempted = 0;
  double idle_after_s = 0;  // worker-seconds after the last answer, the largest of a worker
  std::vector<FleetMoment> moments;
};

FleetOutcome simulate_fleet(const FleetScenario& scenario);

// A day's work on 10,000 cores: the scenario of tests and docs.
FleetScenario large_fleet(std::uint64_t seed);

}  // namespace gapfarm
