// A farm as a closed queueing network, to say what was not measured (docs/scaling.md).
#pragma once

namespace gapfarm {

struct FarmModel {
  unsigned workers = 1;
  unsigned window = 2;   // jobs in a worker's hand, >= 1
  double service_s = 0;  // of a worker, a task
  double main_s = 0;     // of the master's thread that schedules, a task
  double link_s = 0;     // of its thread that reads, writes and encrypts, a task
  double delay_s = 0;    // a task spends on the way, waiting for nobody
};

struct FarmForecast {
  double tasks_per_s = 0;
  double efficiency = 0;    // share of the time in which a worker has work, [0, 1]
  double round_trip_s = 0;  // from a worker's result to the job that replaces it
};

// Every job goes round: worker, link, scheduler, link, worker.  `workers` times `window` jobs
// circulate; each worker is a station of its own, the master's threads are two that all share.
// Approximate mean value analysis after Schweitzer (1979), for exponential service; regular service
// makes queues shorter, so this errs to the side of caution.
// REQUIRES: workers, window > 0; the times not negative and not all zero.
FarmForecast forecast(const FarmModel& model);

}  // namespace gapfarm
