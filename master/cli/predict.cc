// gapfarm predict RUN|MODEL: the predictive distribution of every trial of a log.
#include <Eigen/Core>
#include <cmath>
#include <memory>

#include "common/score/fitness.h"
#include "common/score/motion_model.h"
#include "common/trials/files.h"
#include "common/trials/read.h"
#include "master/cli/inputs.h"
#include "master/report/prediction_table.h"

namespace gapfarm {
namespace {

struct PredictOptions {
  std::string model;
  std::vector<std::string> mined;
  std::vector<std::string> trials;
  std::string out = "-";
  FarmOptions farm;
};

Result<std::vector<PredictedTrial>> predict_by_model(const Model& model, const TrialLog& log,
                                                     const PredictOptions& options,
                                                     CliContext& context) {
  Problem problem = problem_of(model);
  problem.log = log;
  // Any fitness will do; this one asks nothing of the log.
  problem.fitness.kind = FitnessKind::kLogScore;
  auto farm = start_farm(options.farm, {}, context);
  if (!farm) return farm.error();
  v1::Task task;
  task.mutable_predict();
  const auto results = (*farm)->run((*farm)->add_problem(to_proto(problem)), {task});
  if (!results) return results.error();
  const v1::TaskResult& result = results->front();
  if (result.outcome() != v1::OK) {
    return Error{options.model + ": the simulation ended with " +
                 v1::Outcome_Name(result.outcome()) + " (" + result.message() + ")"};
  }
  return world_predictions(result.predict());
}

Result<std::vector<PredictedTrial>> predict_by_log(const TrialLog& log,
                                                   const PredictOptions& options) {
  const std::vector<CommandSpec> commands = default_commands("srv1");
  const Result<TrialLog> mined = read_trial_files(options.mined, command_names(commands));
  if (!mined) return mined.error();
  const Result<MotionModel> model = MotionModel::mine(*mined, commands);
  if (!model) return model.error();
  std::vector<PredictedTrial> predictions;
  for (const Trial& trial : log.trials) {
    const CommandSpec command = resolved_command(trial, commands);
    const auto prediction = model->predict(trial.X_WS, command);
    if (!prediction) return prediction.error();
    const auto score = model->log_density(trial.X_WS, command, trial.X_WE);
    if (!score) return score.error();
    predictions.push_back({prediction->X_WE, prediction->covariance, *score});
  }
  return predictions;
}

int run_predict(const PredictOptions& options, CliContext& context) {
  Console& console = context.console;
  if (options.model.empty() == options.mined.empty()) {
    console.error(Error{"give either a run or model file, or --mined LOG"});
    return kExitBadUsage;
  }
  Result<Model> model =
      options.mined.empty() ? read_model_of(options.model) : nominal_model("srv1");
  if (!model) {
    console.error(model.error());
    return kExitBadUsage;
  }
  const Result<TrialLog> log = read_trial_files(options.trials, command_names(model->commands));
  if (!log) {
    console.error(log.error());
    return kExitBadUsage;
  }
  show_notes(*log, console);
  const auto predictions = options.mined.empty() ? predict_by_model(*model, *log, options, context)
                                                 : predict_by_log(*log, options);
  if (!predictions) return failed(predictions.error(), context);
  const std::string table = format_predictions(*log, *predictions);
  if (options.out == "-") {
    console.print(table);
  } else if (Status s = write_file_atomically(options.out, table); !s) {
    return failed(s.error(), context);
  }
  console.note(summarise_predictions(*log, *predictions));
  return kExitDone;
}

}  // namespace

SubcommandRun setup_predict(CLI::App& app) {
  auto options = std::make_shared<PredictOptions>();
  app.add_option("RUN|MODEL", options->model, "Run folder or model.toml");
  app.add_option("--trials", options->trials, "Trial logs to predict")->required();
  app.add_option("--out", options->out, "CSV to write; - for stdout");
  app.add_option("--mined", options->mined,
                 "Predict by the motion model mined from these logs, P(M' | M, u), in place of a "
                 "simulation");
  options->farm.declare(app, false);
  app.footer(
      "Examples:\n"
      "  gapfarm predict run/demo --trials trials.csv --out predictions.csv\n"
      "  gapfarm predict --mined monday.csv --trials tuesday.csv");
  return [options](CliContext& context) { return run_predict(*options, context); };
}

}  // namespace gapfarm
