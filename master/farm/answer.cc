#include "master/farm/answer.h"

#include <cmath>

namespace gapfarm {

bool answers(const v1::Task& task, const v1::TaskResult& result) {
  const v1::Outcome outcome = result.outcome();
  if (outcome == v1::OUTCOME_UNSPECIFIED || !v1::Outcome_IsValid(outcome)) return false;
  if (outcome == v1::WORKER_FAILED) return false;  // the master's own word
  if (outcome != v1::OK && outcome != v1::INFEASIBLE) return true;
  switch (task.kind_case()) {
    case v1::Task::kEvaluate:
      return result.has_evaluate() && std::isfinite(result.evaluate().fitness()) &&
             std::isfinite(result.evaluate().penalty());
    case v1::Task::kPredict:
      return result.has_predict();
    case v1::Task::kSimulate:
      return result.has_simulate();
    case v1::Task::kTrace:
      return result.has_trace();
    case v1::Task::kEcho:
      return result.kind_case() == v1::TaskResult::kEcho;
    default:
      return true;
  }
}

}  // namespace gapfarm
