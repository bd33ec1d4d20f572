// What a simulated second costs.  "sim_s" is simulated seconds a second of one core.
#include <benchmark/benchmark.h>

#include <array>

#include "worker/scenarios/srv1/srv1_robot.h"
#include "worker/sim/robot/simulator.h"

namespace gapfarm {
namespace {

constexpr double kFullSpeed_m_s = 0.28;
constexpr std::array<std::array<double, 2>, 6> kDuties{
    {{1, 1}, {-1, -1}, {-0.3, 0.3}, {0.3, -0.3}, {0.4, 1}, {1, 0.4}}};

SimSettings srv1_settings() {
  const ParameterValues values = srv1_table().nominal();
  return sim_settings(srv1_robot().size(), values, ActiveEffects(srv1_table(), values));
}

DriveInput drive_of(const std::array<double, 2>& duty) {
  DriveInput drive;
  drive.left.speed_m_s = duty[0] * kFullSpeed_m_s;
  drive.right.speed_m_s = duty[1] * kFullSpeed_m_s;
  return drive;
}

// All six commands, 1 s each and settling.
void run_commands(benchmark::State& state, const SimSettings& settings, const Floor& floor = {}) {
  Simulator simulator(settings);
  double simulated_s = 0;
  const std::uint64_t steps = simulator.steps();
  for (auto _ : state) {
    for (const auto& duty : kDuties) {
      simulated_s += simulator.run(drive_of(duty), floor).duration_s;
    }
  }
  state.counters["sim_s"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
  state.counters["steps"] = benchmark::Counter(static_cast<double>(simulator.steps() - steps),
                                               benchmark::Counter::kIsRate);
}

void BM_TreadsSixCommands(benchmark::State& state) {
  SimSettings settings = srv1_settings();
  settings.step_rate_hz = static_cast<double>(state.range(0));
  run_commands(state, settings);
}
BENCHMARK(BM_TreadsSixCommands)
    ->Arg(60)
    ->Arg(120)
    ->Arg(240)
    ->Arg(960)
    ->Unit(benchmark::kMillisecond);

void BM_TreadsSixCommandsEveryFloorEffect(benchmark::State& state) {
  Floor floor;
  floor.tilt_rad = 0.02;
  floor.nap_strength = 0.05;
  floor.rolling_resistance = 0.05;
  floor.patches[0].radius_m = 0.1;
  floor.patches[0].ratio = 0.7;
  run_commands(state, srv1_settings(), floor);
}
BENCHMARK(BM_TreadsSixCommandsEveryFloorEffect)->Unit(benchmark::kMillisecond);

void BM_WheelsSixCommands(benchmark::State& state) {
  SimSettings settings = srv1_settings();
  settings.robot = RobotModel::kWheels;
  settings.wheel_shape = static_cast<WheelShape>(state.range(0));
  run_commands(state, settings);
}
BENCHMARK(BM_WheelsSixCommands)->DenseRange(0, 3)->Unit(benchmark::kMillisecond);

void BM_Construct(benchmark::State& state) {
  SimSettings settings = srv1_settings();
  settings.robot = static_cast<RobotModel>(state.range(0));
  for (auto _ : state) {
    Simulator simulator(settings);
    benchmark::DoNotOptimize(&simulator);
  }
}
BENCHMARK(BM_Construct)->DenseRange(0, 1)->Unit(benchmark::kMicrosecond);

// A run of no duration: reset and the 50 ms that count as rest.
void BM_ResetAndRest(benchmark::State& state) {
  SimSettings settings = srv1_settings();
  settings.robot = static_cast<RobotModel>(state.range(0));
  Simulator simulator(settings);
  DriveInput drive;
  drive.duration_s = 0;
  for (auto _ : state) benchmark::DoNotOptimize(simulator.run(drive, {}));
}
BENCHMARK(BM_ResetAndRest)->DenseRange(0, 1)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace gapfarm

BENCHMARK_MAIN();
