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
  // Share of those two threads that one connection takes, busy or not: heartbeats.
  double main_idle = 0;
  double link_idle = 0;
  // Where workers and master share cores: CPU time of all their threads a task, over the cores.
  double shared_s = 0;
};

struct FarmForecast {
  double tasks_per_s = 0;
  double efficiency = 0;    // share of the time in which a worker has work, [0, 1]
  double round_trip_s = 0;  // from a worker's result to the job that replaces it
};

// Every job goes round: worker, link, scheduler, link, worker.  `workers` times `window` jobs
// circulate; each worker is a station of its own, the master's threads are two that all share, and
// so are the cores.
//
// Approximate mean value analysis after Schweitzer (1979), for exponential service; regular service
// makes queues shorter, bursts at the start of a batch make them longer.
//
// REQUIRES: workers, window > 0; the times not negative and not all zero.  Connections that alone
// take more than a thread has leave no tasks a second.
FarmForecast forecast(const FarmModel& model);

// The most workers, up to `limit`, that are busy for at least `efficiency` of the time.
//
// REQUIRES: service_s > 0.
unsigned workers_carried(FarmModel model, double efficiency, unsigned limit);

}  // namespace gapfarm
