#include "common/random/stream.h"
#include "worker/scenarios/program.h"
#include "worker/scenarios/scenario.h"

namespace gapfarm {
namespace {

// Without noise one seed a run: what a program draws is the same whatever its values, so that no
// set of values is better by luck.
std::uint32_t seed_of(const v1::StreamKey& key, bool noisy) {
  StreamKey drawn{key.run_seed(), Purpose::kEvaluation, 0, 0, 0};
  if (noisy) drawn = {key.run_seed(), Purpose::kEvaluation, 0, key.birth_id(), key.replicate()};
  return static_cast<std::uint32_t>(Stream(drawn).bits());
}

class ObjectiveModel final : public ScenarioModel {
 public:
  explicit ObjectiveModel(const Problem& problem)
      : problem_(problem), program_(shared_simulator(problem.external->command)) {}

  v1::TaskResult evaluate(const ParameterValues& values, const v1::EvaluateTask& task,
                          StepCounter* steps) const override {
    if (auto refusal = refuse_to_start()) return *refusal;
    ExternalRequest request;
    request.declaration = &problem_.external->table.declaration();
    request.values = values;
    for (const SearchedObjective& objective : problem_.fitness.objectives) {
      request.objectives.push_back(objective.name);
    }
    request.seed = seed_of(task.stream(), problem_.spread.kind == SpreadKind::kSampled);
    const auto answer = ask_program(*program_, request, *problem_.external, steps);
    v1::TaskResult result;
    result.set_message(answer ? answer->message : answer.error().message);
    if (!answer) {
      result.set_outcome(outcome_of(answer.error()));
    } else if (answer->diverged) {
      result.set_outcome(v1::DIVERGED);
    } else {
      result.set_outcome(answer->violation > 0 ? v1::INFEASIBLE : v1::OK);
      result.mutable_evaluate()->set_fitness(answer->value);
      result.mutable_evaluate()->set_penalty(answer->violation);
      result.mutable_evaluate()->mutable_objectives()->Add(answer->values.begin(),
                                                           answer->values.end());
      result.mutable_evaluate()->set_conditions(1);
    }
    return result;
  }

 private:
  const Problem& problem_;
  std::shared_ptr<ExternalSimulator> program_;
};

}  // namespace

std::unique_ptr<ScenarioModel> prepare_objective(const Problem& problem) {
  return std::make_unique<ObjectiveModel>(problem);
}

}  // namespace gapfarm
