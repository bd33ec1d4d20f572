// gapfarm predict RUN|MODEL: the predictive distribution of every trial of a log.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <tuple>

#include "common/base/ranges.h"
#include "common/score/fitness.h"
#include "common/score/motion_model.h"
#include "master/cli/subcommand.h"
#include "master/command/outputs.h"
#include "master/report/prediction_table.h"
#include "master/run/run.h"

namespace gapfarm {
namespace {

struct PredictOptions : LongOptions {
  std::string model;
  std::vector<std::string> mined;
  TrialOptions trials;
};

// The log in parts that many workers can have and a stop does not lose; trials of one command stay
// together, since a condition is simulated once a part.
std::vector<v1::Task> predict_tasks(const TrialLog& log) {
  constexpr std::size_t kMostTrials = 500;  // a part
  std::vector<std::uint32_t> order(log.trials.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) {
    const Trial& t = log.trials[i];
    return std::tuple(t.command, t.left, t.right, t.duration_s);
  };
  std::ranges::stable_sort(order,
                           [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  const std::size_t parts = (order.size() + kMostTrials - 1) / kMostTrials;
  std::vector<v1::Task> tasks(std::max<std::size_t>(1, parts));
  for (v1::Task& task : tasks) task.mutable_predict();
  if (tasks.size() == 1) return tasks;
  for (std::size_t i = 0; i < order.size(); ++i) {
    tasks[i * parts / order.size()].mutable_predict()->add_trials(order[i]);
  }
  return tasks;
}

Problem problem_with(const Model& model, const TrialLog& log) {
  Problem problem = problem_of(model);
  problem.log = shifted(log, -model.frame_x_m, -model.frame_y_m);
  return problem;
}

Result<std::vector<PredictedTrial>> predict_by_model(const Model& model, const TrialLog& log,
                                                     const PredictOptions& options,
                                                     CliContext& context) {
  Problem problem = problem_with(model, log);
  // Any fitness will do; this one asks nothing of the log.
  problem.fitness.kind = FitnessKind::kLogScore;
  const std::vector<v1::Task> tasks = predict_tasks(log);
  ASSIGN_OR_RETURN(const auto asked,
                   options.begin("predict", {{"predict", 1, tasks.size()}}, {}, context));
  context.work->stage(0);
  ASSIGN_OR_RETURN(const auto results, asked->run(asked->add_problem(to_proto(problem)), tasks));
  v1::PredictResult whole;
  for (const v1::TaskResult& result : results) {
    RETURN_IF_ERROR(ended_well(result, options.model + ": the simulation"));
    whole.MergeFrom(result.predict());
  }
  std::sort(whole.mutable_predictions()->begin(), whole.mutable_predictions()->end(),
            [](const v1::Predicted& a, const v1::Predicted& b) { return a.trial() < b.trial(); });
  std::vector<PredictedTrial> predictions = world_predictions(whole);
  for (PredictedTrial& p : predictions) {
    p.X_WE.x += model.frame_x_m;
    p.X_WE.y += model.frame_y_m;
  }
  return predictions;
}

Result<std::vector<PredictedTrial>> predict_by_log(const TrialLog& log,
                                                   const PredictOptions& options,
                                                   Console& console) {
  const std::vector<CommandSpec> commands = default_commands("srv1");
  ReadOptions reading = options.trials.read;
  reading.paths.clear();  // they are those of the trials to predict
  ASSIGN_OR_RETURN(const TrialLog mined,
                   read_trial_files(options.mined, command_names(commands), reading));
  show_notes(mined, console);
  ASSIGN_OR_RETURN(const MotionModel model, MotionModel::mine(mined, commands));
  std::vector<PredictedTrial> predictions;
  for (const Trial& trial : log.trials) {
    const CommandSpec command = resolved_command(trial, commands);
    ASSIGN_OR_RETURN(const auto prediction, model.predict(trial.X_WS, command));
    ASSIGN_OR_RETURN(const auto score, model.log_density(trial.X_WS, command, trial.X_WE));
    predictions.push_back({prediction.X_WE, prediction.covariance, score});
  }
  return predictions;
}

// Beside the table on standard output there is no room for a summary.  `beside`: what predictions
// without a simulation score, or empty.
void show_summary(const TrialLog& log, const std::vector<PredictedTrial>& predictions,
                  const std::string& beside, const PredictOptions& options, Console& console) {
  const std::string summary = summarise_predictions(log, predictions);
  const std::string text = beside.empty() ? summary : summary + "\n" + beside;
  if (options.out == "-" && !console.json()) return console.note(text);
  Json json = {{"trials", predictions.size()}, {"summary", summary}};
  double score = 0;
  for (const PredictedTrial& p : predictions) {
    score += p.log_score / static_cast<double>(predictions.size());
  }
  json["log_score"] = score;
  if (!beside.empty()) json["without_a_simulation"] = beside;
  if (options.out != "-") {
    json["out"] = options.out;
  } else {
    for (std::size_t i = 0; i < predictions.size(); ++i) {
      const PredictedTrial& p = predictions[i];
      json["predictions"].push_back({{"session", log.trials[i].session},
                                     {"trial", log.trials[i].trial},
                                     {"x", p.X_WE.x},
                                     {"y", p.X_WE.y},
                                     {"theta", p.X_WE.theta},
                                     {"log_score", p.log_score}});
    }
  }
  console.result(text + "\n", json);
}

Result<int> run_predict(PredictOptions& options, CliContext& context) {
  Console& console = context.console;
  if (options.model.empty() == options.mined.empty()) {
    return Error{"give either a run or model file, or --mined LOG"};
  }
  ASSIGN_OR_RETURN(const Model model, options.mined.empty() ? read_model_of(options.model, console)
                                                            : nominal_model("srv1"));
  ASSIGN_OR_RETURN(
      const TrialLog log,
      read_trial_files(options.trials.files, command_names(model.commands), options.trials.read));
  show_notes(log, console);
  if (options.mined.empty()) show_warnings(problem_with(model, log), {}, console);
  options.outputs.reads(log);
  options.outputs.reads(options.model);
  options.outputs.reads((std::filesystem::path(options.model) / "model.toml").string());
  for (const std::string& file : options.mined) options.outputs.reads(file);
  RETURN_IF_ERROR(options.outputs.plan(options.out));
  if (context.dry_run) {
    const std::string by = options.mined.empty() ? options.model : "the mined motion model";
    return print_dry_run(fmt::format("predict {} trials by {}", log.trials.size(), by),
                         {{"out", options.out}, {"trials", log.trials.size()}}, options.farm, {},
                         context);
  }
  context.begun = true;
  ASSIGN_OR_RETURN(const auto predictions, options.mined.empty()
                                               ? predict_by_model(model, log, options, context)
                                               : predict_by_log(log, options, console));
  const std::string table = format_predictions(log, predictions);
  if (options.out == "-") {
    if (!console.json()) console.print(table);
  } else {
    RETURN_IF_ERROR(options.outputs.write(options.out, table));
  }
  std::string beside;
  if (options.mined.empty()) {
    ASSIGN_OR_RETURN(beside,
                     baseline_note(model, log, mapped(predictions, &PredictedTrial::log_score)));
  }
  show_summary(log, predictions, beside, options, console);
  return kExitDone;
}

}  // namespace

SubcommandRun setup_predict(CLI::App& app) {
  auto options = std::make_shared<PredictOptions>();
  app.add_option("RUN|MODEL", options->model, "Run folder or model.toml");
  options->trials.declare(app, "Trial logs to predict")->required();
  options->out = "-";
  app.add_option("--out", options->out, "CSV to write; - for stdout");
  app.add_option(
      "--mined", options->mined,
      "Predict by the motion model mined from these logs, P(M' | M, u), in place of a simulation");
  options->declare(app, LongOptions::Leaves::kFile, false);
  app.footer(
      "Examples:\n"
      "  gapfarm predict run/demo --trials trials.csv --out predictions.csv\n"
      "  gapfarm predict --mined monday.csv --trials tuesday.csv");
  return [options](CliContext& context) { return run_predict(*options, context); };
}

}  // namespace gapfarm
