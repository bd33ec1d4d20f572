#include "master/run/baseline_notes.h"

#include <algorithm>
#include <filesystem>

#include "common/trials/read.h"

namespace gapfarm {
namespace {

// Of trials that the model was fitted to.  A baseline has a handful of numbers a command: fitted to
// the trials that it is scored on it would look better than it is.
constexpr const char* kFromOthers =
    "learned from the other sessions or parts of the log (the model has seen all of it)";

bool same_trials(const TrialLog& a, const TrialLog& b) {
  const auto same = [](const Trial& s, const Trial& t) {
    return s.session == t.session && s.trial == t.trial && s.command == t.command &&
           s.X_WS.x == t.X_WS.x && s.X_WE.x == t.X_WE.x && s.X_WE.y == t.X_WE.y;
  };
  return std::equal(a.trials.begin(), a.trials.end(), b.trials.begin(), b.trials.end(), same);
}

std::string note(const std::vector<BaselineComparison>& baselines, const std::string& how) {
  const std::string sentence = baseline_sentence(baselines, "the model");
  return sentence.empty() ? sentence : "without a simulation, " + how + ": " + sentence;
}

}  // namespace

bool has_baselines(std::string_view scenario) {
  const ScenarioForm& form = scenario_form(scenario);
  return !form.pieces && form.commands().size() > 1;
}

std::optional<TrialLog> trials_behind(const Model& model) {
  std::error_code code;
  for (const std::string& file : model.data.files) {
    if (!std::filesystem::is_regular_file(file, code)) return std::nullopt;
  }
  if (model.data.files.empty()) return std::nullopt;
  auto log = read_trial_files(model.data.files, command_names(model.commands));
  if (!log || log->trials.size() != model.data.trials) return std::nullopt;
  return *std::move(log);
}

Result<std::string> baseline_note(const Model& model, const TrialLog& log,
                                  std::span<const double> scores) {
  if (!has_baselines(model.scenario) || log.trials.empty()) return std::string();
  const auto behind = trials_behind(model);
  if (behind && !same_trials(*behind, log)) {
    ASSIGN_OR_RETURN(const auto baselines, baseline_scores(*behind, log, model.commands));
    return note(compare_with_baselines(baselines, scores), "learned from the model's trials");
  }
  ASSIGN_OR_RETURN(const auto baselines,
                   crossfitted_baselines(log, model.commands, session_folds(log)));
  return note(compare_with_baselines(baselines, scores),
              behind ? kFromOthers : "learned from the other sessions of this log");
}

Result<std::string> baseline_note_of_run(const Problem& problem, const Genome& genome, Farm& farm) {
  if (!has_baselines(problem.scenario) || problem.log.trials.empty()) return std::string();
  ASSIGN_OR_RETURN(const auto results,
                   farm.run(farm.add_problem(to_proto(problem)), {prediction_task(genome, false)}));
  if (results.front().outcome() != v1::OK) return std::string();
  ASSIGN_OR_RETURN(const auto beside, baselines_beside(problem, results.front().predict()));
  return note(beside, kFromOthers);
}

Result<std::vector<BaselineComparison>> baselines_beside(const Problem& problem,
                                                         const v1::PredictResult& prediction) {
  if (!has_baselines(problem.scenario) || problem.log.trials.empty()) {
    return std::vector<BaselineComparison>();
  }
  std::vector<double> scores;
  for (const v1::Predicted& p : prediction.predictions()) scores.push_back(p.log_score());
  ASSIGN_OR_RETURN(const auto baselines, crossfitted_baselines(problem.log, problem.commands,
                                                               session_folds(problem.log)));
  return compare_with_baselines(baselines, scores);
}

}  // namespace gapfarm
