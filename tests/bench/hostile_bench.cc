// What hostile peers cost a farm: the same batches with CURVE, left in peace and attacked.  The
// attackers need cores too: compare the master's CPU time, not only the wall's.
#include <benchmark/benchmark.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/bench/bench_farm_setup.h"
#include "tests/integration/hostile_peers.h"

namespace gapfarm {
namespace {

// Repeats `round` in a process of its own until end_child().
pid_t in_child(const std::function<void()>& round) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (;;) round();
}

void end_child(pid_t pid) {
  if (pid < 0) return;
  kill(pid, SIGKILL);
  waitpid(pid, nullptr, 0);
}

double process_cpu_s() {
  rusage usage = {};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

struct Attacked {
  std::string name;
  std::function<std::function<void()>(int port)> round;
};

const std::vector<Attacked>& kinds() {
  static const std::vector<Attacked> all = {
      {"peace", nullptr},
      {"garbage", [](int port) { return [port] { send_garbage(port); }; }},
      {"oversize", [](int port) { return [port] { send_oversize_handshake(port); }; }},
      {"no_keys", [](int port) { return [port] { greet_without_keys(port); }; }},
      {"slow", [](int port) { return [port] { greet_byte_by_byte(port); }; }},
      {"half_open",
       [](int port) {
         return [peers = std::make_shared<HalfOpen>(port, 3000)] { peers->round(); };
       }},
  };
  return all;
}

// Arguments: kind of attack, microseconds a task, tasks.  The attacker runs in a child process, so
// that its CPU time is not the master's.
void attacked(benchmark::State& state) {
  Bench bench(kCurve, 2);
  const Attacked& kind = kinds().at(static_cast<std::size_t>(state.range(0)));
  state.SetLabel(kind.name);
  const std::string endpoint = bench.farm->endpoints().at(0);
  const int port = std::stoi(endpoint.substr(endpoint.rfind(':') + 1));
  const auto tasks = echo_tasks(static_cast<std::size_t>(state.range(2)),
                                static_cast<std::uint64_t>(state.range(1)), 100);
  const pid_t attacker = kind.round == nullptr ? -1 : in_child(kind.round(port));
  bench.run(tasks);
  const double cpu = process_cpu_s();
  for (auto _ : state) bench.run(tasks);
  state.counters["master_cpu_us_a_task"] =
      1e6 * (process_cpu_s() - cpu) /
      static_cast<double>(static_cast<std::size_t>(state.iterations()) * tasks.size());
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(tasks.size()));
  end_child(attacker);
}

BENCHMARK(attacked)
    ->ArgNames({"attack", "us", "tasks"})
    ->ArgsProduct({{0, 1, 2, 3, 4, 5}, {10000}, {200}})
    ->ArgsProduct({{0, 1, 2, 3, 4, 5}, {0}, {20000}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gapfarm

BENCHMARK_MAIN();
