// What one master carries: thousands of workers on loopback TCP that only echo, at once or after a
// while by the clock.
//   bench_scaling                                    every figure
//   bench_scaling --benchmark_filter='echo.*link:1'
// link: 1 tcp, 2 tcp with CURVE.  Counters: CPU time of the master's scheduling thread (`main_us`)
// and of its other threads (`link_us`) and of the fleet (`fleet_us`) a task; memory of the whole
// master (`rss_MB`); from a result to the next jobs as a worker sees it (`next_job_*_ms`); seconds
// until all workers had answered (`join_s`).  `forecast_per_s` is what farm_model.h says of
// these costs, on as many cores as this machine has.
#include <benchmark/benchmark.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <thread>

#include "common/base/clock.h"
#include "tests/bench/farm_model.h"
#include "tests/bench/fleet_bench.h"

namespace gapfarm {
namespace {

double cpu_s(clockid_t clock) {
  timespec t = {};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double resident_MB() {
  std::ifstream in("/proc/self/statm");
  double size = 0, resident = 0;
  in >> size >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

void measure(benchmark::State& state, Link link, unsigned workers, double service_s,
             std::size_t count) {
  FleetBench bench(link, workers, service_s);
  bench.run(count);
  bench.fleet->latency().clear();
  const double begun = monotonic_seconds();
  const double main = cpu_s(CLOCK_THREAD_CPUTIME_ID);
  const double all = cpu_s(CLOCK_PROCESS_CPUTIME_ID);
  const double fleet = bench.fleet->cpu_s();
  for (auto _ : state) bench.run(count);
  const double tasks = static_cast<double>(count) * static_cast<double>(state.iterations());
  const double main_s = cpu_s(CLOCK_THREAD_CPUTIME_ID) - main;
  const double link_s = cpu_s(CLOCK_PROCESS_CPUTIME_ID) - all - main_s;
  const double wall_s = monotonic_seconds() - begun;
  state.SetItemsProcessed(static_cast<std::int64_t>(tasks));
  state.counters["main_us"] = 1e6 * main_s / tasks;
  state.counters["link_us"] = 1e6 * link_s / tasks;
  state.counters["fleet_us"] = 1e6 * (bench.fleet->cpu_s() - fleet) / tasks;
  state.counters["rss_MB"] = resident_MB();
  state.counters["join_s"] = bench.join_s;
  state.counters["next_job_p50_ms"] = 1e3 * bench.fleet->latency().quantile(0.5);
  state.counters["next_job_p99_ms"] = 1e3 * bench.fleet->latency().quantile(0.99);
  if (!(service_s > 0)) return;
  FarmModel model;
  model.workers = workers;
  model.service_s = service_s;
  model.main_s = main_s / tasks;
  model.link_s = link_s / tasks;
  const double cores = std::max(1u, std::thread::hardware_concurrency());
  model.shared_s = (main_s + link_s + bench.fleet->cpu_s() - fleet) / tasks / cores;
  state.counters["efficiency"] = tasks * service_s / (workers * wall_s);
  state.counters["forecast_per_s"] = forecast(model).tasks_per_s;
}

// Arguments: link, workers.
void echo(benchmark::State& state) {
  const auto workers = static_cast<unsigned>(state.range(1));
  measure(state, static_cast<Link>(state.range(0)), workers, 0,
          std::max<std::size_t>(20000, 20 * workers));
}

// Arguments: link, workers, microseconds a task.  Batches of about two seconds of work.
void timed(benchmark::State& state) {
  const auto workers = static_cast<unsigned>(state.range(1));
  const double service_s = 1e-6 * static_cast<double>(state.range(2));
  const double wanted = std::min(2 / service_s * workers, 40000.0);
  measure(state, static_cast<Link>(state.range(0)), workers, service_s,
          std::max<std::size_t>(4 * workers, static_cast<std::size_t>(wanted)));
}

BENCHMARK(echo)
    ->ArgNames({"link", "workers"})
    ->ArgsProduct({{kTcp, kCurve}, {1, 10, 100, 500, 1000, 2000}})
    ->Iterations(3)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(timed)
    ->ArgNames({"link", "workers", "us"})
    ->ArgsProduct({{kTcp, kCurve}, {5, 10, 20, 50}, {1000}})
    ->ArgsProduct({{kTcp, kCurve}, {50, 100, 200, 500}, {10000}})
    ->ArgsProduct({{kTcp, kCurve}, {500, 1000, 2000}, {100000}})
    ->ArgsProduct({{kTcp, kCurve}, {2000}, {1000000}})
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gapfarm

BENCHMARK_MAIN();
