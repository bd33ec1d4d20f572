// What the farm itself costs: echo tasks through one master with real worker processes.
//   bench_farm                      every figure
//   bench_farm --benchmark_filter=efficiency
// link: 0 ipc, 1 tcp, 2 tcp with CURVE.
#include <benchmark/benchmark.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <vector>

#include "common/base/clock.h"
#include "tests/bench/bench_farm_setup.h"

namespace gapfarm {
namespace {

// Arguments: link, workers.  Tasks of 100 bytes, a batch of 20,000.
void throughput(benchmark::State& state) {
  Bench bench(static_cast<Link>(state.range(0)), static_cast<unsigned>(state.range(1)));
  const auto tasks = echo_tasks(20000, 0, 100);
  bench.run(tasks);
  for (auto _ : state) bench.run(tasks);
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(tasks.size()));
}

// Argument: link.  One task at a time: master to worker and back.
void round_trip(benchmark::State& state) {
  Bench bench(static_cast<Link>(state.range(0)), 1);
  const auto task = echo_tasks(1, 0, 100);
  for (auto _ : state) bench.run(task);
}

double thread_cpu_s() {
  timespec t = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Wall time of two processes that do nothing but use `cpu_s` of a core each.
double two_loops_s(double cpu_s) {
  const double begun = monotonic_seconds();
  std::array<pid_t, 2> loops = {};
  for (pid_t& loop : loops) {
    loop = fork();
    if (loop != 0) continue;
    const double until = thread_cpu_s() + cpu_s;
    while (thread_cpu_s() < until) {
    }
    _exit(0);
  }
  for (const pid_t loop : loops) waitpid(loop, nullptr, 0);
  return monotonic_seconds() - begun;
}

// CPU time (s) and waits of this process, or of its children that have ended.
struct Spent {
  explicit Spent(int who) {
    rusage usage = {};
    getrusage(who, &usage);
    cpu_s = static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
            1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
    waits = static_cast<double>(usage.ru_nvcsw);
  }
  double cpu_s = 0;
  double waits = 0;
};

// Arguments: link, microseconds a task, tasks a batch.  Two workers; `efficiency` is the work over
// the two cores' time.  Where others use the cores as well, two loops that share nothing do not
// reach 1 either: `two_loops` is what they reached just before and after, and `of_two_loops` the
// farm's share of that.  A task costs `master_us` and `worker_us` beyond the work, and makes
// threads of both wait `waits` times.
void efficiency(benchmark::State& state) {
  const auto tasks = echo_tasks(static_cast<std::size_t>(state.range(2)),
                                static_cast<std::uint64_t>(state.range(1)), 100);
  const double work_s = 1e-6 * static_cast<double>(state.range(1));
  const double batch_s = work_s * static_cast<double>(tasks.size()) / 2;
  const double loops_s = std::max(0.5, batch_s);
  const Spent workers_before(RUSAGE_CHILDREN);
  auto bench = std::make_unique<Bench>(static_cast<Link>(state.range(0)), 2);
  bench->run(tasks);
  double alone_s = two_loops_s(loops_s);
  const Spent master_before(RUSAGE_SELF);
  const double begun = monotonic_seconds();
  for (auto _ : state) bench->run(tasks);
  const double wall = monotonic_seconds() - begun;
  const Spent master(RUSAGE_SELF);
  alone_s += two_loops_s(loops_s);
  bench.reset();
  const Spent workers(RUSAGE_CHILDREN);
  const auto runs = static_cast<double>(state.iterations());
  const auto count = static_cast<double>(tasks.size());
  state.counters["efficiency"] = batch_s * runs / wall;
  state.counters["two_loops"] = 2 * loops_s / alone_s;
  state.counters["of_two_loops"] = state.counters["efficiency"] / state.counters["two_loops"];
  state.counters["master_us"] = 1e6 * (master.cpu_s - master_before.cpu_s) / (runs * count);
  if (state.range(0) != kIpc) return;
  state.counters["worker_us"] =
      1e6 * ((workers.cpu_s - workers_before.cpu_s - 4 * loops_s) / ((runs + 1) * count) - work_s);
  state.counters["waits"] = (master.waits - master_before.waits) / (runs * count) +
                            (workers.waits - workers_before.waits) / ((runs + 1) * count);
}

BENCHMARK(throughput)
    ->ArgNames({"link", "workers"})
    ->ArgsProduct({{kIpc, kTcp, kCurve}, {1, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(round_trip)
    ->ArgNames({"link"})
    ->Arg(kIpc)
    ->Arg(kTcp)
    ->Arg(kCurve)
    ->UseRealTime()
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(efficiency)
    ->ArgNames({"link", "us", "tasks"})
    ->Args({kIpc, 10000, 200})
    ->Args({kTcp, 10000, 200})
    ->Args({kCurve, 10000, 200})
    ->Args({kIpc, 10000, 40})
    ->Args({kIpc, 1000, 2000})
    ->Args({kTcp, 1000, 2000})
    ->Args({kCurve, 1000, 2000})
    ->Args({kIpc, 1000, 40})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gapfarm

BENCHMARK_MAIN();
