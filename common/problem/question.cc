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

const v1::Point* point_of(const v1::Task& task) {
  if (task.has_evaluate()) return &task.evaluate().point();
  if (task.has_predict()) return &task.predict().point();
  if (task.has_simulate()) return &task.simulate().point();
  return task.has_trace() ? &task.trace().point() : nullptr;
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

std::string point_settings(const Problem& problem, const v1::Task& task) {
  const v1::Point* point = point_of(task);
  if (point == nullptr) return {};
  const Genome genome(point->genome().begin(), point->genome().end());
  if (!genome.empty() && genome.size() != problem.genes.size()) return {};
  std::string text;
  const auto add = [&](std::size_t row, double value) {
    text += std::string(text.empty() ? "" : " ") + "--set " + problem.table()[row].key + "=" +
            problem.table().text_of(row, value);
  };
  const ParameterValues values = problem.values_of(genome);
  for (std::size_t i = 0; i < genome.size(); ++i) {
    add(problem.genes[i].row, values[problem.genes[i].row]);
  }
  for (const v1::Override& override : point->overrides()) {
    if (override.parameter() < values.size()) add(override.parameter(), override.value());
  }
  return text;
}

}  // namespace gapfarm
