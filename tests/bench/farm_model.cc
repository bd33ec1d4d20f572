#include "tests/bench/farm_model.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace gapfarm {

FarmForecast forecast(const FarmModel& model) {
  constexpr int kMostRounds = 100000;
  constexpr double kClose = 1e-12;
  const double window = model.window;
  const double jobs = window * model.workers;
  const double main_free = 1 - model.workers * model.main_idle;
  const double link_free = 1 - model.workers * model.link_idle;
  if (main_free <= 0 || link_free <= 0) return {};
  const std::array<double, 3> demands = {model.main_s / main_free, model.link_s / link_free,
                                         model.shared_s};
  std::array<double, 3> queues = {jobs / 3, jobs / 3, jobs / 3};  // of all workers' jobs
  double in_hand = window / 3;                                    // of one worker
  double rate = 0;                                                // of one worker
  double at_master = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    // A job that arrives finds what the others would have queued without it.
    const double at_worker = model.service_s * (1 + in_hand * (window - 1) / window);
    std::array<double, 3> stays = {};
    at_master = model.delay_s;
    for (std::size_t i = 0; i < demands.size(); ++i) {
      stays[i] = demands[i] * (1 + queues[i] * (jobs - 1) / jobs);
      at_master += stays[i];
    }
    const double before = rate;
    rate = window / (at_worker + at_master);
    in_hand = rate * at_worker;
    for (std::size_t i = 0; i < demands.size(); ++i) queues[i] = model.workers * rate * stays[i];
    if (std::abs(rate - before) <= kClose * rate) break;
  }
  FarmForecast result;
  result.tasks_per_s = rate * model.workers;
  result.efficiency = std::min(1.0, rate * model.service_s);
  result.round_trip_s = at_master;
  return result;
}

unsigned workers_carried(FarmModel model, double efficiency, unsigned limit) {
  // More workers never make one busier.
  unsigned carried = 0;
  for (unsigned step = std::bit_floor(std::max(limit, 1u)); step > 0; step /= 2) {
    model.workers = carried + step;
    if (model.workers <= limit && forecast(model).efficiency >= efficiency) carried += step;
  }
  return carried;
}

}  // namespace gapfarm
