#include "master/experiments/crossfit/tuning.h"

#include <algorithm>

#include "common/base/try.h"
#include "master/evolve/evolve.h"
#include "master/evolve/optimisers.h"

namespace gapfarm {
namespace {

v1::Task evaluate_task(const Genome& genome, std::uint64_t seed, std::uint64_t birth_id) {
  v1::Task task;
  v1::EvaluateTask* evaluate = task.mutable_evaluate();
  evaluate->mutable_point()->mutable_genome()->Assign(genome.begin(), genome.end());
  evaluate->mutable_stream()->set_run_seed(seed);
  evaluate->mutable_stream()->set_birth_id(birth_id);
  return task;
}

class Backend : public EvaluationBackend {
 public:
  Backend(const Problem& problem, Farm& farm, std::uint64_t seed)
      : kind_(problem.fitness.kind), farm_(farm), seed_(seed) {
    hash_ = farm.add_problem(to_proto(problem));
  }

  Result<std::vector<Score>> evaluate(std::span<const Candidate> candidates) override {
    std::vector<v1::Task> tasks;
    for (const Candidate& c : candidates)
      tasks.push_back(evaluate_task(c.genome, seed_, c.birth_id));
    ASSIGN_OR_RETURN(const auto results, farm_.run(hash_, tasks));
    std::vector<Score> scores;
    for (const v1::TaskResult& result : results) {
      const bool ok = result.outcome() == v1::OK;
      scores.push_back(
          {result.outcome(), ok ? cost_of_fitness(kind_, result.evaluate().fitness()) : 0});
    }
    return scores;
  }

 private:
  FitnessKind kind_;
  Farm& farm_;
  std::uint64_t seed_;
  std::string hash_;
};

class NoSink : public GenerationSink {
 public:
  Status commit(const GenerationRecord& /*record*/) override { return {}; }
};

// Nothing here stops by time.
class NoClock : public EvolveClock {
 public:
  double now_s() const override { return 0; }
};

}  // namespace

std::uint64_t expected_evaluations(const EvolutionSettings& settings) {
  const std::uint64_t all = settings.generations * settings.population;
  return settings.evaluations ? std::min(*settings.evaluations, all) : all;
}

Result<Tuned> tune(const Problem& problem, Farm& farm, const TuningSettings& settings) {
  OptimiserSetup setup;
  setup.settings = settings.evolution;
  setup.table = &problem.table();
  setup.genes = problem.genes;
  setup.run_seed = settings.seed;
  setup.noisy =
      problem.spread.kind == SpreadKind::kSampled && !compares_means(problem.fitness.kind);
  for (const Gene& gene : problem.genes) {
    setup.nominal.push_back(encode_gene(problem.table(), gene, problem.values[gene.row]));
  }
  ASSIGN_OR_RETURN(auto optimiser, make_optimiser(setup));
  Backend backend(problem, farm, settings.seed);
  NoSink sink;
  const NoClock clock;
  EvolveOptions options;
  options.settings = settings.evolution;
  options.fitness = problem.fitness.kind;
  ASSIGN_OR_RETURN(const auto summary, evolve(*optimiser, backend, sink, clock, options));
  if (!summary.best || summary.best->outcome != v1::OK) {
    return Error{"every genome failed; widen or move the genes' ranges"};
  }
  return Tuned{problem.values_of(summary.best->genome),
               fitness_of_cost(problem.fitness.kind, summary.best->cost), summary.evaluations};
}

Result<std::vector<PredictedEnds>> predict_ends(const Problem& problem,
                                                const std::vector<ParameterValues>& points,
                                                Farm& farm, bool log_scores) {
  Problem plain = problem;
  plain.genes.clear();
  // Any fitness will do; this one asks nothing of the log.
  plain.fitness.kind = FitnessKind::kLogScore;
  std::vector<v1::Task> tasks;
  for (const ParameterValues& values : points) {
    v1::Task task;
    task.mutable_predict()->set_means_only(!log_scores);
    for (std::size_t row = 0; row < values.size(); ++row) {
      if (values[row] == plain.values[row]) continue;
      v1::Override* to = task.mutable_predict()->mutable_point()->add_overrides();
      to->set_parameter(static_cast<std::uint32_t>(row));
      to->set_value(values[row]);
    }
    tasks.push_back(std::move(task));
  }
  ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(plain)), tasks));
  std::vector<PredictedEnds> all;
  for (const v1::TaskResult& result : results) {
    PredictedEnds& predicted = all.emplace_back();
    if (result.outcome() != v1::OK) {
      predicted.failure = v1::Outcome_Name(result.outcome()) + " (" + result.message() + ")";
      continue;
    }
    for (const v1::Predicted& p : result.predict().predictions()) {
      predicted.ends.push_back(from_proto(p.end()));
      if (log_scores) predicted.log_scores.push_back(p.log_score());
    }
  }
  return all;
}

}  // namespace gapfarm
