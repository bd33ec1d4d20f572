#include "master/diagnose/predictor.h"

namespace gapfarm {
namespace {

Error bad_point(const Problem& problem, const Overrides& at, const v1::TaskResult& result) {
  std::string text = "the simulation ended with " + v1::Outcome_Name(result.outcome()) + " (" +
                     result.message() + ") at";
  for (const auto& [row, value] : at) {
    text += " " + problem.table()[row].key + " = " + problem.table().format(row, value);
  }
  return Error{text};
}

}  // namespace

v1::Task predict_task(const Overrides& at, bool means_only) {
  v1::Task task;
  task.mutable_predict()->set_means_only(means_only);
  for (const auto& [row, value] : at) {
    v1::Override* to = task.mutable_predict()->mutable_point()->add_overrides();
    to->set_parameter(static_cast<std::uint32_t>(row));
    to->set_value(value);
  }
  return task;
}

Result<std::vector<std::vector<Pose>>> Predictor::ends(
    const std::vector<PredictionRequest>& requests) {
  std::vector<v1::Task> tasks;
  for (const PredictionRequest& request : requests) {
    tasks.push_back(predict_task(request.at, true));
    tasks.back().mutable_predict()->mutable_trials()->Add(request.trials.begin(),
                                                          request.trials.end());
  }
  simulation_failed_ = false;
  const auto results = farm_.run(hash_, tasks);
  if (!results) return results.error();
  predictions_ += requests.size();
  std::vector<std::vector<Pose>> ends;
  for (std::size_t k = 0; k < requests.size(); ++k) {
    const v1::TaskResult& result = (*results)[k];
    if (result.outcome() != v1::OK) {
      simulation_failed_ = true;
      return bad_point(problem_, requests[k].at, result);
    }
    std::vector<Pose>& to = ends.emplace_back();
    for (const v1::Predicted& p : result.predict().predictions()) to.push_back(from_proto(p.end()));
  }
  return ends;
}

Result<std::vector<double>> Predictor::log_scores(const Overrides& at) {
  const auto results = farm_.run(hash_, {predict_task(at, false)});
  if (!results) return results.error();
  ++predictions_;
  const v1::TaskResult& result = results->front();
  if (result.outcome() != v1::OK) return bad_point(problem_, at, result);
  std::vector<double> scores;
  for (const v1::Predicted& p : result.predict().predictions()) scores.push_back(p.log_score());
  return scores;
}

}  // namespace gapfarm
