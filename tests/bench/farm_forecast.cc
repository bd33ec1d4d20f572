// What one master carries, from what its tasks and connections cost it: the table of
// docs/scaling.md.
//   farm_forecast --main-us 6 --link-us 13 --main-idle-us 9 --link-idle-us 47
#include <CLI/CLI.hpp>
#include <cstdio>

#include "tests/bench/farm_model.h"

int main(int argc, char** argv) {
  CLI::App app("Workers that one master keeps busy, by the length of an evaluation.");
  double main_us = 0, link_us = 0, main_idle_us = 0, link_idle_us = 0, efficiency = 0.95;
  unsigned limit = 16384;
  app.add_option("--main-us", main_us, "CPU time of the scheduling thread, a task")->required();
  app.add_option("--link-us", link_us, "CPU time of the other threads, a task")->required();
  app.add_option("--main-idle-us", main_idle_us, "The same, a connection and second");
  app.add_option("--link-idle-us", link_idle_us, "The same of the other threads");
  app.add_option("--efficiency", efficiency, "Of the time, a worker must be busy");
  app.add_option("--limit", limit, "Connections");
  CLI11_PARSE(app, argc, argv);
  std::printf("evaluation   workers   tasks/s   round trip\n");
  for (const double service_s : {1e-3, 1e-2, 1e-1, 1.0}) {
    gapfarm::FarmModel model;
    model.service_s = service_s;
    // As the scheduler does: enough for 4 ms in hand (SchedulerOptions::window_s), two at least.
    model.window = service_s < 2e-3 ? 5 : 2;
    model.main_s = 1e-6 * main_us;
    model.link_s = 1e-6 * link_us;
    model.main_idle = 1e-6 * main_idle_us;
    model.link_idle = 1e-6 * link_idle_us;
    model.workers = gapfarm::workers_carried(model, efficiency, limit);
    if (model.workers == 0) continue;
    const gapfarm::FarmForecast found = gapfarm::forecast(model);
    std::printf("%7g ms   %7u   %7.0f   %7.2f ms\n", 1e3 * service_s, model.workers,
                found.tasks_per_s, 1e3 * found.round_trip_s);
  }
  return 0;
}
