// What the farm itself costs: echo tasks through one master with real worker processes.
//   bench_farm                      every figure
//   bench_farm --benchmark_filter=efficiency
// link: 0 ipc, 1 tcp, 2 tcp with CURVE.
#include <benchmark/benchmark.h>
#include <stdlib.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/process/process_pool.h"
#include "master/farm/socket_farm.h"

namespace gapfarm {
namespace {

const char* const kWorkerProgram = GAPFARM_BIN_DIR "/gapfarm-fake-worker";

enum Link { kIpc, kTcp, kCurve };

std::vector<v1::Task> echo_tasks(std::size_t count, std::uint64_t busy_us, std::size_t bytes) {
  std::vector<v1::Task> tasks(count);
  for (v1::Task& task : tasks) {
    task.mutable_echo()->set_payload(std::string(bytes, 'x'));
    task.mutable_echo()->set_busy_us(busy_us);
  }
  return tasks;
}

// Keys of a master and its workers, gone with their owner.
class BenchKeys {
 public:
  BenchKeys() {
    std::string pattern = (std::filesystem::temp_directory_path() / "gapfarm-keys-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
    const auto folder = KeyFolder::open(path_);
    const KeyPair worker = make_key_pair("worker");
    const bool made = folder && folder->add_pair("master", make_key_pair("master")) &&
                      folder->add_pair("worker", worker) &&
                      folder->list({"worker", worker.public_key});
    if (!made) std::fprintf(stderr, "no keys\n");
  }
  ~BenchKeys() { std::filesystem::remove_all(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// A farm whose workers have all answered.
struct Bench {
  Bench(Link link, unsigned workers) {
    SocketFarmOptions options;
    options.worker_program = kWorkerProgram;
    options.on_event = [](const FarmEvent&) {};
    if (link == kIpc) {
      options.local_workers = workers;
    } else {
      options.listen = {"tcp://127.0.0.1:*"};
      options.security.open = OpenLinks::kLoopback;
      if (link == kCurve) options.security = master_security(keys.path()).value();
    }
    farm = std::move(SocketFarm::create(options)).value();
    if (link != kIpc) start_remote(link, workers);
    while (farm->workers().size() < workers) run(echo_tasks(2 * workers, 1000, 0));
  }

  void start_remote(Link link, unsigned workers) {
    ProcessPoolOptions options;
    options.program = kWorkerProgram;
    std::vector<std::string> arguments = {"--connect", farm->endpoints().at(0), "--processes",
                                          std::to_string(workers)};
    if (link == kTcp) arguments.push_back("--insecure");
    if (link == kCurve) arguments.insert(arguments.end(), {"--keys", keys.path()});
    options.arguments = [arguments](const std::string&, const ProcessEnded*) { return arguments; };
    remote = std::make_unique<ProcessPool>(std::move(options));
    if (!remote->start(monotonic_seconds())) std::fprintf(stderr, "no workers\n");
  }

  void run(const std::vector<v1::Task>& tasks) {
    if (!farm->run("", tasks)) std::fprintf(stderr, "a run failed\n");
  }

  BenchKeys keys;
  std::unique_ptr<ProcessPool> remote;
  std::unique_ptr<SocketFarm> farm;
};

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

// Arguments: link, microseconds a task, tasks a batch.  Two workers; `efficiency` is the work over
// the two cores' time.
void efficiency(benchmark::State& state) {
  Bench bench(static_cast<Link>(state.range(0)), 2);
  const auto tasks = echo_tasks(static_cast<std::size_t>(state.range(2)),
                                static_cast<std::uint64_t>(state.range(1)), 100);
  bench.run(tasks);
  const double begun = monotonic_seconds();
  for (auto _ : state) bench.run(tasks);
  const double wall = monotonic_seconds() - begun;
  const double work = 1e-6 * static_cast<double>(state.range(1)) *
                      static_cast<double>(tasks.size()) * static_cast<double>(state.iterations());
  state.counters["efficiency"] = work / (2 * wall);
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
    ->Args({kIpc, 10000, 40})
    ->Args({kIpc, 1000, 2000})
    ->Args({kTcp, 1000, 2000})
    ->Args({kIpc, 1000, 40})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gapfarm

BENCHMARK_MAIN();
