#include "common/problem/question.h"

#include "common/base/hash.h"

namespace gapfarm {
namespace {

constexpr std::size_t kPayloadShown = 20;

std::string of_birth(const char* what, const v1::StreamKey& stream) {
  std::string text = what;
  text += " of birth " + std::to_string(stream.birth_id());
  if (stream.replicate() != 0) text += ", replicate " + std::to_string(stream.replicate());
  return text;
}

}  // namespace

// Tasks have no map fields, so their serialisation is the same everywhere in one build.
std::string question_hash(const std::string& problem_hash, const v1::Task& task) {
  return content_hash(problem_hash + '\n' + task.SerializeAsString());
}

std::string task_label(const v1::Task& task) {
  switch (task.kind_case()) {
    case v1::Task::kEvaluate:
      return of_birth("evaluation", task.evaluate().stream());
    case v1::Task::kPredict:
      return of_birth("prediction", task.predict().stream());
    case v1::Task::kSimulate:
      return "simulation of a session";
    case v1::Task::kTrace:
      return "trace of command " + task.trace().command().name();
    case v1::Task::kEcho:
      return "echo of '" + task.echo().payload().substr(0, kPayloadShown) + "'";
    default:
      return "task";
  }
}

}  // namespace gapfarm
