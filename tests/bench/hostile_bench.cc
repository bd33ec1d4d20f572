// What hostile peers cost a farm: the same batches with CURVE, left in peace and attacked as fast
// as one process can.  In `attacked` workers, master and attacker share this machine's cores, so
// that most of what is lost the attacker's own CPU time takes: compare the master's.  In
// `attacked_master` workers need no cores, as if they were elsewhere.
#include <benchmark/benchmark.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <functional>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "tests/bench/fleet_bench.h"
#include "tests/integration/hostile_peers.h"

namespace gapfarm {
namespace {

// Repeats `round` (may be empty) in a process of its own, so that its CPU time is not the master's.
class Attacker {
 public:
  explicit Attacker(const std::function<void()>& round) {
    void* page =
        mmap(nullptr, sizeof *rounds_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (page == MAP_FAILED) std::abort();
    rounds_ = new (page) std::atomic<std::uint64_t>(0);
    if (!round) return;
    pid_ = fork();
    if (pid_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (;; ++*rounds_) round();
  }
  ~Attacker() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    munmap(rounds_, sizeof *rounds_);
  }
  Attacker(const Attacker&) = delete;
  Attacker& operator=(const Attacker&) = delete;

  double rounds() const { return static_cast<double>(*rounds_); }

 private:
  std::atomic<std::uint64_t>* rounds_ = nullptr;
  pid_t pid_ = -1;
};

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

// `run` runs a batch of `count` tasks on `farm`.
void attack(benchmark::State& state, const SocketFarm& farm, std::size_t count,
            const std::function<void()>& run) {
  const Attacked& kind = kinds().at(static_cast<std::size_t>(state.range(0)));
  state.SetLabel(kind.name);
  const std::string endpoint = farm.endpoints().at(0);
  const int port = std::stoi(endpoint.substr(endpoint.rfind(':') + 1));
  const Attacker attacker(kind.round ? kind.round(port) : nullptr);
  run();
  const double rounds = attacker.rounds();
  const double begun = monotonic_seconds();
  const double cpu = process_cpu_s();
  for (auto _ : state) run();
  const double wall = monotonic_seconds() - begun;
  const auto tasks = static_cast<double>(count) * static_cast<double>(state.iterations());
  state.counters["master_cpu_us_a_task"] = 1e6 * (process_cpu_s() - cpu) / tasks;
  state.counters["master_cores"] = (process_cpu_s() - cpu) / wall;
  state.counters["rounds_per_s"] = (attacker.rounds() - rounds) / wall;
  state.SetItemsProcessed(static_cast<std::int64_t>(tasks));
}

// Arguments: kind of attack, microseconds a task, tasks.  Two worker processes.
void attacked(benchmark::State& state) {
  Bench bench(kCurve, 2);
  const auto tasks = echo_tasks(static_cast<std::size_t>(state.range(2)),
                                static_cast<std::uint64_t>(state.range(1)), 100);
  attack(state, *bench.farm, tasks.size(), [&] { bench.run(tasks); });
}

// Argument: kind of attack.  100 workers with evaluations of 10 ms by the clock.
void attacked_master(benchmark::State& state) {
  constexpr std::size_t kTasks = 20000;
  FleetBench bench(kCurve, 100, 0.01);
  attack(state, *bench.farm, kTasks, [&] { bench.run(kTasks); });
}

BENCHMARK(attacked_master)
    ->ArgNames({"attack"})
    ->DenseRange(0, 5)
    ->Iterations(1)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(attacked)
    ->ArgNames({"attack", "us", "tasks"})
    ->ArgsProduct({{0, 1, 2, 3, 4, 5}, {10000}, {200}})
    ->ArgsProduct({{0, 1, 2, 3, 4, 5}, {0}, {20000}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gapfarm

BENCHMARK_MAIN();
