#include "master/run/outputs.h"

#include <spdlog/fmt/fmt.h>

#include "common/base/try.h"
#include "common/config/model.h"
#include "common/trials/files.h"
#include "master/report/figures/line_chart.h"
#include "master/report/figures/pose_picture.h"
#include "master/run/baseline_notes.h"
#include "master/run/run_page.h"
#include "master/store/run_reader.h"

namespace gapfarm {
namespace {

Model model_of(const RunStore& store, const Problem& problem, const Config& config,
               const EvolveSummary& summary) {
  Model model = model_of_problem(problem, problem.values_of(summary.best->genome));
  model.score = fitness_of_cost(problem.fitness.kind, summary.best->cost);
  model.data = {store.info().problem_hash, problem.log.trials.size(), config.trial_files};
  model.origin = {store.run().string(), config.seed, summary.generations, summary.evaluations};
  return model;
}

v1::Task predict_task(const Genome& genome) {
  v1::Task task;
  task.mutable_predict()->mutable_point()->mutable_genome()->Assign(genome.begin(), genome.end());
  return task;
}

// Each beside what the best scores on the trials that it can predict.
std::vector<ScoreRow> baseline_rows(const std::vector<BaselineComparison>& comparisons) {
  std::vector<ScoreRow> rows;
  for (const BaselineComparison& c : comparisons) {
    rows.push_back({fmt::format("{}, {} trials", c.name, c.trials), c.baseline, {}, {}});
    rows.push_back({"the best, on the same trials", c.model, {}, {}});
  }
  return rows;
}

Status write_poses(RunStore& store, const Problem& problem, const EvolveSummary& summary,
                   Farm& farm, const std::vector<Validated>& validated) {
  // As the config had them, and as evolved.
  ASSIGN_OR_RETURN(const auto results,
                   farm.run(farm.add_problem(to_proto(problem)),
                            {predict_task({}), predict_task(summary.best->genome)}));
  std::vector<PredictionOfLog> predictions;
  const char* const labels[] = {"before", "after"};
  const PredictionOfLog* known[] = {nullptr, nullptr};
  predictions.reserve(results.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i].outcome() != v1::OK) continue;  // a nominal robot may fall over
    known[i] = &predictions.emplace_back(PredictionOfLog{labels[i], results[i].predict()});
  }
  RunOutcome outcome = run_outcome(problem, known[0], known[1], validated);
  if (known[1] != nullptr) {
    ASSIGN_OR_RETURN(const auto beside, baselines_beside(problem, known[1]->prediction));
    outcome.baselines = baseline_rows(beside);
  }
  RETURN_IF_ERROR(store.keep_document(kOutcomeDocument, to_json(outcome)));
  const std::string title =
      fmt::format("End poses of {} trials, measured and simulated", problem.log.trials.size());
  return write_file_atomically(
      (store.run() / "poses.svg").string(),
      pose_picture(pose_panels(problem, predictions), title,
                   "Seen from the start, before and after evolution; ellipses hold 90 % of "
                   "the simulated positions"));
}

Status write_fitness(const RunStore& store) {
  ASSIGN_OR_RETURN(const auto reader, RunReader::open(store.run()));
  ASSIGN_OR_RETURN(const auto generations, reader.generations());
  std::vector<FitnessPoint> points;
  for (const StoredGeneration& g : generations) {
    points.push_back({g.generation, g.best, g.median, g.worst});
  }
  const RunInfo& info = store.info();
  return write_file_atomically((store.run() / "fitness.svg").string(),
                               fitness_chart(points, "Fitness by generation", info.fitness,
                                             info.fitness_unit, info.higher_is_better));
}

Status write_page(const RunStore& store) {
  ASSIGN_OR_RETURN(const auto report, read_run_report({store.run(), {}, {}}));
  return write_file_atomically((store.run() / "report.html").string(), run_html(report));
}

}  // namespace

std::vector<std::string> output_files(const Problem& problem) {
  if (is_value(problem.fitness.kind)) return {"model.toml", "report.html", "fitness.svg"};
  return {"model.toml", "report.html", "poses.svg", "fitness.svg"};
}

Status write_outputs(RunStore& store, const Problem& problem, const Config& config,
                     const EvolveSummary& summary, Farm& farm,
                     const std::vector<Validated>& validated) {
  const Model model = model_of(store, problem, config, summary);
  RETURN_IF_ERROR(write_model(model, (store.run() / "model.toml").string()));
  if (!is_value(problem.fitness.kind)) {
    RETURN_IF_ERROR(write_poses(store, problem, summary, farm, validated));
  }
  RETURN_IF_ERROR(write_fitness(store));
  return write_page(store);
}

}  // namespace gapfarm
