// What one evaluation costs, and what it grows with: trials, conditions, genome.
#include <benchmark/benchmark.h>

#include "common/parameters/table.h"
#include "tests/unit/worker/problems.h"
#include "worker/evaluate.h"

namespace gapfarm {
namespace {

// Evaluates genomes whose friction differs from one to the next, as evolution does.
void evaluate_often(benchmark::State& state, const Problem& problem) {
  const auto prepared = prepare(to_proto(problem));
  if (!prepared) {
    state.SkipWithError(prepared.error().message.c_str());
    return;
  }
  v1::Task task;
  v1::Point* point = task.mutable_evaluate()->mutable_point();
  for (const Gene& gene : problem.genes) {
    point->add_genome(encode_gene(problem.table(), gene, problem.values[gene.row]));
  }
  v1::Override* friction = point->add_overrides();
  friction->set_parameter(static_cast<std::uint32_t>(row_of(Srv1::kFriction)));
  int evaluations = 0;
  for (auto _ : state) {
    friction->set_value(0.5 + 0.001 * (++evaluations % 100));
    const v1::TaskResult result = evaluate(prepared->get(), task);
    if (result.outcome() != v1::OK) state.SkipWithError(result.message().c_str());
  }
}

void BM_Trials(benchmark::State& state) {
  evaluate_often(state, tests::small_problem(static_cast<std::size_t>(state.range(0))));
  state.SetComplexityN(state.range(0));
}
BENCHMARK(BM_Trials)
    ->ArgName("trials")
    ->ArgsProduct({{60, 240, 960, 3840, 15360}})
    ->Unit(benchmark::kMillisecond);

// As many conditions as asked for, in 960 trials: every command with several durations about 1 s.
void BM_Conditions(benchmark::State& state) {
  Problem problem = tests::small_problem(960);
  const std::size_t durations = static_cast<std::size_t>(state.range(0)) / problem.commands.size();
  for (std::size_t i = 0; i < problem.log.trials.size(); ++i) {
    const std::size_t which = i / problem.commands.size() % durations;
    problem.log.trials[i].duration_s =
        0.95 + 0.1 * static_cast<double>(which) / static_cast<double>(durations);
  }
  evaluate_often(state, problem);
  state.SetComplexityN(state.range(0));
}
BENCHMARK(BM_Conditions)
    ->ArgName("conditions")
    ->ArgsProduct({{6, 12, 24, 48, 96}})
    ->Complexity(benchmark::oN)
    ->Unit(benchmark::kMillisecond);

// The first rows of the table from the mass on, searched or not: what a gene adds.
void BM_Genes(benchmark::State& state) {
  Problem problem = tests::small_problem(120);
  const std::size_t first = row_of(Srv1::kMass);
  for (std::size_t row = first; row < first + static_cast<std::size_t>(state.range(0)); ++row) {
    const Parameter& parameter = problem.table().rows()[row];
    problem.genes.push_back({row, parameter.lower, parameter.upper, parameter.scale});
  }
  evaluate_often(state, problem);
}
BENCHMARK(BM_Genes)->ArgName("genes")->Arg(0)->Arg(1)->Arg(5)->Arg(11)->Unit(
    benchmark::kMillisecond);

}  // namespace
}  // namespace gapfarm

BENCHMARK_MAIN();
