#include "master/experiments/blind_check/fresh.h"

#include "common/base/try.h"
#include "common/config/model.h"

namespace gapfarm {
namespace {

v1::Task predict_with(const ParameterValues& problem, const ParameterValues& values) {
  v1::Task task;
  v1::Point* point = task.mutable_predict()->mutable_point();
  for (std::size_t row = 0; row < values.size(); ++row) {
    if (values[row] == problem[row]) continue;
    v1::Override* override = point->add_overrides();
    override->set_parameter(static_cast<std::uint32_t>(row));
    override->set_value(values[row]);
  }
  return task;
}

std::optional<double> mean_log_score(const v1::TaskResult& result) {
  const v1::PredictResult& predict = result.predict();
  if (result.outcome() != v1::OK || predict.predictions_size() == 0) return std::nullopt;
  double sum = 0;
  for (const v1::Predicted& p : predict.predictions()) sum += p.log_score();
  return sum / predict.predictions_size();
}

}  // namespace

std::optional<DiagnosedCase> read_diagnosed_case(const Truth& truth, const std::string& folder) {
  const Result<Model> tuned = read_model(folder + "/tuned.toml");
  const Result<Model> final_model = read_model(folder + "/model.toml");
  if (!tuned || !final_model || tuned->scenario != final_model->scenario) return std::nullopt;
  return DiagnosedCase{truth, tuned->values, final_model->values, final_model->residual};
}

Result<std::vector<std::optional<FreshScores>>> score_fresh_logs(
    const Config& config, const std::vector<DiagnosedCase>& cases, const SessionPlans& plan,
    Farm& farm, const DesignProgress& progress) {
  std::vector<Truth> truths;
  for (const DiagnosedCase& c : cases) truths.push_back(c.truth);
  ASSIGN_OR_RETURN(std::vector<TrialLog> logs,
                   simulate_cases(config, truths, plan, /*seed_offset=*/1, farm, progress));
  std::vector<std::optional<FreshScores>> scores;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    Problem problem = config.problem;
    problem.genes.clear();
    problem.fitness.kind = FitnessKind::kLogScore;
    problem.log = std::move(logs[i]);
    for (Trial& trial : problem.log.trials) trial.path.clear();
    for (const v1::Override& o : overrides_of(problem.table(), truths[i])) {
      problem.values[o.parameter()] = o.value();
    }
    ASSIGN_OR_RETURN(const auto results, farm.run(farm.add_problem(to_proto(problem)),
                                                  {predict_with(problem.values, cases[i].tuned),
                                                   predict_with(problem.values, cases[i].final_),
                                                   predict_with(problem.values, problem.values)}));
    const auto tuned = mean_log_score(results[0]);
    const auto final_score = mean_log_score(results[1]);
    const auto truth = mean_log_score(results[2]);
    scores.emplace_back();
    if (tuned && final_score && truth) {
      scores.back() = FreshScores{*tuned, *final_score, *truth, std::nullopt};
    }
    if (scores.back() && !cases[i].residual.empty()) {
      Problem corrected = problem;
      corrected.residual = cases[i].residual;
      ASSIGN_OR_RETURN(const auto result,
                       farm.run(farm.add_problem(to_proto(corrected)),
                                {predict_with(problem.values, cases[i].final_)}));
      scores.back()->corrected = mean_log_score(result.front());
    }
    if (progress) progress("fresh logs predicted", i + 1, cases.size());
  }
  return scores;
}

}  // namespace gapfarm
