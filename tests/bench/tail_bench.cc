// How busy evolution keeps a farm whose evaluations take very different times: the loop, the
// genetic algorithm, the scheduler, the workers' sessions and the wire format as they are, under a
// virtual clock.  Evaluations take 1 s in the mean, log-normal; their times are their own, so that
// a copy of a slow one is no faster.  `efficiency`: the times of all evaluations that came back
// between the commits of generations 4 and 16, over workers by the time that passed.
//   bench_scaling --benchmark_filter='tail|lag'
// Arguments: workers, individuals a worker, sigma in hundredths, jobs in a worker's hand,
// 1: asynchronous.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <queue>

#include "common/random/stream.h"
#include "master/evolve/evolve.h"
#include "tests/unit/evolve/toy_problems.h"
#include "tests/unit/farm/simulated_farm.h"

namespace gapfarm {
namespace {

constexpr std::uint64_t kFirst = 4, kLast = 16;  // generations between which is measured

class VirtualFarm {
 public:
  VirtualFarm(const ToyRun& run, unsigned workers, double sigma, unsigned window)
      : run_(run), farm_(1, workers, without_faults(window)), sigma_(sigma) {}

  double now_s() const { return farm_.now(); }
  double worked_s() const { return worked_s_; }

  Status operator()(std::vector<Candidate> candidates, const TakeScore& take) {
    std::vector<Score> scores;
    std::vector<double> times_s;
    const auto sent = [&](const std::vector<Candidate>& all) {
      std::vector<v1::Task> tasks;
      for (const Candidate& candidate : all) {
        tasks.push_back(task_of(candidate));
        scores.push_back(run_.score(candidate));
        times_s.push_back(time_of(tasks.back()));
      }
      return tasks;
    };
    const auto on_answer = [&](std::size_t place,
                               const v1::TaskResult&) -> Result<std::vector<v1::Task>> {
      worked_s_ += times_s[place];
      const auto next = take(place, scores[place]);
      if (!next) return next.error();
      return sent(*next);
    };
    if (farm_.stream(sent(candidates), on_answer, kLimit_s)) return {};
    return Error{"not done"};
  }

 private:
  static constexpr double kLimit_s = 1e5;
  static FaultPlan without_faults(unsigned window) {
    FaultPlan none;
    none.span_s = 0;
    none.heartbeat_s = 10;
    none.window = window;
    return none;
  }
  static double time_of(const v1::Task& task) {
    return 1e-6 * static_cast<double>(task.echo().busy_us());
  }
  v1::Task task_of(const Candidate& candidate) const {
    Stream stream({.run_seed = 1, .birth_id = candidate.birth_id});
    const double time_s = std::exp(sigma_ * (stream.normal() - sigma_ / 2));
    v1::Task task;
    task.mutable_echo()->set_busy_us(static_cast<std::uint64_t>(1e6 * time_s));
    return task;
  }

  const ToyRun& run_;
  SimulatedFarm farm_;
  double sigma_;
  double worked_s_ = 0;
};

class Stopwatch {
 public:
  explicit Stopwatch(const VirtualFarm& farm) : farm_(farm) {}
  Status operator()(const GenerationRecord& record) {
    if (record.generation == kFirst) begun_ = {farm_.now_s(), farm_.worked_s()};
    if (record.generation < kLast) return {};
    ended_ = {farm_.now_s(), farm_.worked_s()};
    return Error{"seen enough"};
  }
  double busy_workers() const {
    return (ended_.second - begun_.second) / (ended_.first - begun_.first);
  }

 private:
  const VirtualFarm& farm_;
  std::pair<double, double> begun_, ended_;
};

void tail(benchmark::State& state) {
  const auto workers = static_cast<unsigned>(state.range(0));
  EvolutionSettings settings;
  settings.population = workers * static_cast<unsigned>(state.range(1));
  settings.asynchronous = state.range(4) == 1;
  for (auto _ : state) {
    ToyRun run(sphere(10), settings, 1);
    VirtualFarm farm(run, workers, 0.01 * static_cast<double>(state.range(2)),
                     static_cast<unsigned>(state.range(3)));
    Stopwatch watch(farm);
    EvolveOptions options;
    options.settings = settings;
    options.fitness = FitnessKind::kEnergyScore;
    benchmark::DoNotOptimize(
        evolve(
            run.optimiser(), std::ref(farm), std::ref(watch), [&] { return farm.now_s(); }, options)
            .ok());
    state.counters["efficiency"] = watch.busy_workers() / workers;
  }
}

// Without islands: one line of births, each made once all results up to `lag` births before it are
// in.  Arguments: workers, lag over workers.
void lag(benchmark::State& state) {
  const auto workers = static_cast<std::size_t>(state.range(0));
  const std::size_t behind = workers * static_cast<std::size_t>(state.range(1));
  const std::size_t births = 16 * behind;
  for (auto _ : state) {
    Stream stream({.run_seed = 1});
    std::priority_queue<double, std::vector<double>, std::greater<>> free_s;
    for (std::size_t i = 0; i < workers; ++i) free_s.push(0);
    std::vector<double> admitted_s(births);
    for (std::size_t n = 0; n < births; ++n) {
      const double made_s = n < behind ? 0 : admitted_s[n - behind];
      const double done_s = std::max(free_s.top(), made_s) + std::exp(stream.normal() - 0.5);
      free_s.pop();
      free_s.push(done_s);
      admitted_s[n] = std::max(done_s, n > 0 ? admitted_s[n - 1] : 0);
    }
    const std::size_t first = births / 4;
    state.counters["efficiency"] = static_cast<double>(births - 1 - first) /
                                   (admitted_s.back() - admitted_s[first]) /
                                   static_cast<double>(workers);
  }
}

BENCHMARK(lag)
    ->ArgNames({"workers", "lag"})
    ->ArgsProduct({{200, 2000}, {4, 8, 16, 32, 64}})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(tail)
    ->ArgNames({"workers", "each", "sigma", "window", "asynchronous"})
    ->ArgsProduct({{200}, {4, 8, 16}, {30, 100}, {1, 2}, {0, 1}})
    ->ArgsProduct({{2000}, {8}, {100}, {1, 2}, {0, 1}})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gapfarm
