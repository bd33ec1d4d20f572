#include "tests/bench/farm_model.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace gapfarm {

FarmForecast forecast(const FarmModel& model) {
  constexpr int kMostRounds = 100000;
  constexpr double kClose = 1e-12;
  const double window = model.window;
  const double jobs = window * model.workers;
  const std::array<double, 2> demands = {model.main_s, model.link_s};
  std::array<double, 2> queues = {jobs / 3, jobs / 3};  // at the master, of all workers
  double in_hand = window / 3;                          // of one worker
  double rate = 0;                                      // of one worker
  double at_master = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    // A job that arrives finds what the others would have queued without it.
    const double at_worker = model.service_s * (1 + in_hand * (window - 1) / window);
    std::array<double, 2> stays = {};
    at_master = model.delay_s;
    for (std::size_t i = 0; i < 2; ++i) {
      stays[i] = demands[i] * (1 + queues[i] * (jobs - 1) / jobs);
      at_master += stays[i];
    }
    const double before = rate;
    rate = window / (at_worker + at_master);
    in_hand = rate * at_worker;
    for (std::size_t i = 0; i < 2; ++i) queues[i] = model.workers * rate * stays[i];
    if (std::abs(rate - before) <= kClose * rate) break;
  }
  FarmForecast result;
  result.tasks_per_s = rate * model.workers;
  result.efficiency = std::min(1.0, rate * model.service_s);
  result.round_trip_s = at_master;
  return result;
}

}  // namespace gapfarm
