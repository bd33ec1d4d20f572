// What one evaluation of a ground robot costs, and what it grows with: length of the log, windows,
// horizons, wheels.  A Warthog at 240 Hz, runs of 10 s with a new pair of wheel speeds every
// second.
#include <benchmark/benchmark.h>

#include <cmath>
#include <string>
#include <vector>

#include "common/parameters/table.h"
#include "worker/evaluate.h"
#include "worker/sim/robot/ground.h"

namespace gapfarm {
namespace {

constexpr double kRun_s = 10;
constexpr double kPoses_hz = 20;

std::string warthog(int wheels_a_side) {
  std::string text =
      "drive = \"skid\"\ncommands = [\"left\", \"right\"]\nwheel_separation = 1.08\n"
      "mass = 470.0\nlag = 0.3\n";
  for (int k = 0; k < wheels_a_side; ++k) {
    const double x = 0.46 * (1 - 2.0 * k / (wheels_a_side - 1));
    for (const double y : {0.54, -0.54}) {
      text += "[wheels." + std::string(y > 0 ? "left_" : "right_") + std::to_string(k) +
              "]\nradius = 0.3\nx = " + std::to_string(x) + "\ny = " + std::to_string(y) + "\n";
    }
  }
  return text;
}

LoggedRun driven(const Problem& problem, int number) {
  LoggedRun run;
  run.run = std::to_string(number);
  for (int i = 0; i < kRun_s; ++i) {
    run.commands.push_back(
        {1.0 * i, {3 + 3 * std::sin(1.7 * i + number), 3 + 3 * std::cos(2.3 * i + number)}});
  }
  GroundSimulator simulator(problem.ground->robot(), {});
  std::vector<double> times;
  for (int i = 0; i <= kRun_s * kPoses_hz; ++i) times.push_back(i / kPoses_hz);
  for (const GroundSample& s : simulator.run(run.commands, {}, times).samples) {
    run.poses.push_back({s.t_s, s.X_SR});
  }
  return run;
}

Result<Problem> log_of(double minutes, std::vector<double> horizons_s, int wheels_a_side = 2) {
  Problem problem;
  problem.scenario = "ground";
  problem.commands = default_commands("ground");
  if (Status s = problem.set_robot(warthog(wheels_a_side), "warthog.toml"); !s) return s.error();
  RunLog log;
  log.channels = problem.ground->robot().channels;
  for (int r = 0; r < std::lround(60 * minutes / kRun_s); ++r) {
    log.runs.push_back(driven(problem, r));
  }
  auto cut = cut_windows(log, {std::move(horizons_s), 0.5});
  if (!cut) return cut.error();
  problem.runs = std::move(cut->runs);
  problem.log = std::move(cut->log);
  for (const char* key : {"wheel_separation", "wheelbase", "friction", "friction_ratio", "creep",
                          "delay", "lag", "marker.x", "marker.y", "marker.yaw"}) {
    const std::size_t row = problem.table().row(key);
    const Parameter& p = problem.table()[row];
    problem.genes.push_back({row, p.lower, p.upper, p.scale});
  }
  return problem;
}

// Robots that differ from one to the next, as a search's do.
void evaluate_often(benchmark::State& state, const Result<Problem>& problem) {
  if (!problem) {
    state.SkipWithError(problem.error().message.c_str());
    return;
  }
  const auto prepared = prepare(to_proto(*problem));
  if (!prepared) {
    state.SkipWithError(prepared.error().message.c_str());
    return;
  }
  v1::Task task;
  v1::Point* point = task.mutable_evaluate()->mutable_point();
  for (const Gene& gene : problem->genes) {
    point->add_genome(encode_gene(problem->table(), gene, problem->values[gene.row]));
  }
  const double first = point->genome(0);
  int evaluations = 0;
  for (auto _ : state) {
    point->set_genome(0, first + 1e-3 * (++evaluations % 100 - 50));
    const v1::TaskResult result = evaluate(prepared->get(), task);
    if (result.outcome() != v1::OK) state.SkipWithError(result.message().c_str());
  }
  state.counters["windows"] = static_cast<double>(problem->log.trials.size());
}

void BM_GroundMinutes(benchmark::State& state) {
  evaluate_often(state, log_of(static_cast<double>(state.range(0)), {2}));
}
BENCHMARK(BM_GroundMinutes)
    ->ArgName("minutes")
    ->Arg(1)
    ->Arg(3)
    ->Arg(10)
    ->Unit(benchmark::kMillisecond);

// Windows of a tenth of so many seconds, cut out of one minute.
void BM_GroundWindows(benchmark::State& state) {
  evaluate_often(state, log_of(1, {static_cast<double>(state.range(0)) / 10}));
}
BENCHMARK(BM_GroundWindows)
    ->ArgName("tenths_s")
    ->Arg(2)
    ->Arg(5)
    ->Arg(20)
    ->Arg(90)
    ->Unit(benchmark::kMillisecond);

void BM_GroundHorizons(benchmark::State& state) {
  const std::vector<double> all = {2, 0.5, 5, 1, 0.2};
  evaluate_often(state, log_of(1, {all.begin(), all.begin() + state.range(0)}));
}
BENCHMARK(BM_GroundHorizons)
    ->ArgName("horizons")
    ->Arg(1)
    ->Arg(3)
    ->Arg(5)
    ->Unit(benchmark::kMillisecond);

void BM_GroundWheels(benchmark::State& state) {
  evaluate_often(state, log_of(1, {2}, static_cast<int>(state.range(0)) / 2));
}
BENCHMARK(BM_GroundWheels)
    ->ArgName("wheels")
    ->Arg(4)
    ->Arg(6)
    ->Arg(8)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gapfarm

BENCHMARK_MAIN();
