// What a simulator of a user's costs beside its simulation: JSON and pipes, there and back.  This
// program is its own simulator, one that answers at once.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstring>
#include <iostream>
#include <string>

#include "common/base/clock.h"
#include "common/external/simulator.h"
#include "common/process/process_pool.h"

namespace gapfarm {
namespace {

constexpr const char* kParameter =
    R"({"key":"p%","unit":"-","lower":0,"upper":1,"nominal":0.5,"summary":"one of many"})";

std::string introduction(int parameters) {
  std::string rows;
  for (int i = 0; i < parameters; ++i) {
    std::string row = kParameter;
    row.replace(row.find('%'), 1, std::to_string(i));
    rows += (i ? "," : "") + row;
  }
  return R"({"gapfarm":1,"name":"at once","inputs":["path"],"parameters":[)" + rows + "]}";
}

// Answers every question with the same pose, and a path of `samples` when it is asked for one.
int answer_at_once(int parameters, int samples) {
  std::string path;
  for (int i = 0; i < samples; ++i) {
    path += (i ? "," : "") + std::string("[") + std::to_string(i) + ",0.123456789,0.2,0.3]";
  }
  for (std::string line; std::getline(std::cin, line);) {
    const std::size_t at = line.find("\"id\":");
    if (at == line.npos) {
      std::puts(introduction(parameters).c_str());
    } else {
      const std::string id = line.substr(at + 5, line.find(',', at) - at - 5);
      std::printf("{\"id\":%s,\"pose\":[0.123456789,0.2,0.3],\"path\":[%s]}\n", id.c_str(),
                  path.c_str());
    }
    std::fflush(stdout);
  }
  return 0;
}

void BM_Question(benchmark::State& state) {
  const int parameters = static_cast<int>(state.range(0));
  const int samples = static_cast<int>(state.range(1));
  const ExternalCommand command{
      {executable_path(), "--answer", std::to_string(parameters), std::to_string(samples)}, "", 60};
  ExternalSimulator simulator(command, monotonic_seconds);
  const auto introduced = simulator.introduce();
  if (!introduced) return state.SkipWithError(introduced.error().message.c_str());
  const auto program = make_external_program(command, *introduced, /*objective=*/false);
  ExternalRequest request;
  request.declaration = &(*program)->table.declaration();
  request.values.assign(static_cast<std::size_t>(parameters), 0.123456789);
  request.interval_s = samples > 0 ? 0.02 : 0;
  for (auto _ : state) {
    const auto answer = simulator.simulate(request, *introduced);
    if (!answer) return state.SkipWithError(answer.error().message.c_str());
  }
}
BENCHMARK(BM_Question)
    ->ArgNames({"parameters", "samples"})
    ->Args({2, 0})
    ->Args({30, 0})
    ->Args({2, 50})
    ->UseRealTime()
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace gapfarm

int main(int argc, char** argv) {
  if (argc == 4 && std::strcmp(argv[1], "--answer") == 0) {
    return gapfarm::answer_at_once(std::stoi(argv[2]), std::stoi(argv[3]));
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
