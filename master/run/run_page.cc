#include "master/run/run_page.h"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

#include "common/base/hash.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "common/score/motion_model.h"
#include "common/trials/files.h"
#include "master/report/html.h"
#include "master/report/prediction_table.h"
#include "master/run/stored_run.h"

namespace gapfarm {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct PredictedLogEnd {
  Pose X_SE{kNaN, kNaN, kNaN};
  Eigen::Matrix3d cov = Eigen::Matrix3d::Constant(kNaN);
  Eigen::Vector3d residual = Eigen::Vector3d::Constant(kNaN);
  double score = kNaN;
};

PredictedLogEnd predicted(const PredictionOfLog* prediction, std::size_t trial,
                          const Trial& logged) {
  if (prediction == nullptr) return {};
  const v1::Predicted& p = prediction->prediction.predictions(static_cast<int>(trial));
  const Pose X_WP = from_proto(p.end());
  return {between(logged.X_WS, X_WP), local_covariance(p), local_difference(X_WP, logged.X_WE),
          p.log_score()};
}

std::vector<ParameterRow> parameter_rows(const Problem& problem,
                                         const std::vector<StoredIndividual>& last,
                                         const StoredIndividual& best) {
  const ParameterValues after = problem.values_of(best.genome);
  std::vector<ParameterRow> rows;
  for (const Gene& gene : problem.genes) {
    std::vector<double> values;
    for (const StoredIndividual& individual : last) {
      if (individual.genome.size() != problem.genes.size()) continue;
      values.push_back(problem.values_of(individual.genome)[gene.row]);
    }
    ParameterRow& row = rows.emplace_back(
        row_of(problem.table()[gene.row], problem.values[gene.row], after[gene.row]));
    row.lower = gene.lower;
    row.upper = gene.upper;
    if (row.choice.empty() && values.size() >= 4) {
      row.lo = quantile(values, 0.05);
      row.hi = quantile(values, 0.95);
    }
  }
  return rows;
}

// Intervals that `gapfarm determine` worked out for these very values, as remarks.
void add_determined(const std::filesystem::path& file, std::vector<ParameterRow>* rows) {
  const auto text = read_text_file(file.string());
  if (!text) return;
  std::istringstream lines(*text);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells;
    std::istringstream in(line);
    for (std::string cell; std::getline(in, cell, ',');) cells.push_back(std::move(cell));
    const auto row = std::find_if(rows->begin(), rows->end(), [&](const ParameterRow& r) {
      return !cells.empty() && r.key == cells[0];
    });
    if (cells.size() < 6 || row == rows->end() || !row->choice.empty()) continue;
    const auto number = [&](std::size_t i) { return std::strtod(cells[i].c_str(), nullptr); };
    if (std::abs(number(1) - row->after) > 1e-4 * (row->upper - row->lower)) {
      row->note = "gapfarm determine was asked about another value of it";
      continue;
    }
    row->note = fmt::format("95 % by gapfarm determine: {} to {}{}", number_text(number(2), 4),
                            with_unit(number_text(number(3), 4), row->unit),
                            cells[5] == "1" ? "" : "; the data do not determine it");
  }
}

std::string action(const RunReport& report, const RunInfo& info) {
  if (const auto keys = keys_at_bounds(report.parameters); !keys.empty()) {
    return "Widen the range of " + keys.front() + " in [genes]: the best value lies at its end.";
  }
  const std::string run = shell_quoted(report.name);
  if (report.objective) return "gapfarm resume " + run + " --generations N searches on.";
  if (!report.outcome) return "gapfarm resume " + run + " goes on.";
  if (report.outcome->validation.empty()) {
    return report.windows ? "Judge it on runs that it has not seen: gapfarm horizons " + run +
                                " --trials FOLDER"
                          : "Judge it on trials that it has not seen: gapfarm predict " + run +
                                " --trials OTHER.csv";
  }
  return "Ask what is missing: gapfarm diagnose " + shell_quoted(info.config_path) +
         " --out DIAGNOSIS";
}

std::string headline(const RunReport& report) {
  if (report.generations.empty()) return "No generation was completed yet.";
  const RunGeneration& last = report.generations.back();
  if (!report.front.members.empty()) {
    const auto& knee = report.front.members[report.front.knee].objectives;
    return fmt::format("Knee of the front after {} generations: {}", last.generation,
                       joined(knee, ", ", [](const auto& objective) {
                         return objective.first + " " + number_text(objective.second, 6);
                       }));
  }
  return fmt::format("Best {} {} after {} generations", report.fitness,
                     last.best ? with_unit(number_text(*last.best, 6), report.unit)
                               : std::string("none that ended well"),
                     last.generation);
}

Result<std::optional<RunOutcome>> stored_outcome(const RunReader& reader, std::uint64_t last,
                                                 RunReport* report) {
  ASSIGN_OR_RETURN(const auto document, reader.document(kOutcomeDocument));
  if (!document) {
    report->without_outcome =
        "How the best moves is worked out when a run ends, and this one has not; gapfarm resume "
        "goes on.";
    return std::optional<RunOutcome>();
  }
  if (document->generation != last) {
    report->without_outcome = fmt::format(
        "How the best moves was last worked out for generation {}; gapfarm resume goes on and does "
        "it again at the end.",
        document->generation);
    return std::optional<RunOutcome>();
  }
  ASSIGN_OR_RETURN(auto outcome, parse_run_outcome(document->json));
  return std::optional<RunOutcome>(std::move(outcome));
}

Model model_of(const RunStore& store, const RunRequest& run, const EvolveSummary& summary) {
  const Problem& problem = run.problem;
  Model model = model_of_problem(problem, problem.values_of(summary.best->genome));
  model.score = fitness_of_cost(problem.fitness.kind, summary.best->standing.cost);
  model.data = {store.info().problem_hash, problem.log.trials.size(), run.config.trial_files};
  model.origin = {store.run().string(), run.config.seed, summary.generations, summary.evaluations};
  return model;
}

// Each beside what the best scores on the trials that it can predict.
std::vector<ScoreRow> baseline_rows(const std::vector<BaselineComparison>& comparisons) {
  std::vector<ScoreRow> rows;
  for (const BaselineComparison& c : comparisons) {
    rows.push_back({fmt::format("{}, {} trials", c.name, c.trials), c.baseline});
    rows.push_back({"the best, on the same trials", c.model});
  }
  return rows;
}

// Gives what to say of the best beside no simulation.
Result<std::string> write_poses(RunStore& store, const Problem& problem, const Genome& best,
                                Farm& farm, const std::vector<ScoreRow>& validated) {
  // As the config had them, and as evolved.
  ASSIGN_OR_RETURN(const auto results,
                   farm.run(farm.add_problem(to_proto(problem)),
                            {prediction_task(Genome(), false), prediction_task(best, false)}));
  std::vector<PredictionOfLog> predictions;
  const char* const labels[] = {"before", "after"};
  const PredictionOfLog* known[] = {nullptr, nullptr};
  predictions.reserve(results.size());
  for (std::size_t i = 0; i < results.size(); ++i) {
    if (results[i].outcome() != v1::OK) continue;  // a nominal robot may fall over
    known[i] = &predictions.emplace_back(PredictionOfLog{labels[i], results[i].predict()});
  }
  RunOutcome outcome = run_outcome(problem, known[0], known[1], validated);
  std::vector<BaselineComparison> beside;
  if (known[1] != nullptr) {
    ASSIGN_OR_RETURN(beside, baselines_beside(problem, known[1]->prediction));
    outcome.baselines = baseline_rows(beside);
  }
  RETURN_IF_ERROR(store.keep_document(kOutcomeDocument, to_json(outcome)));
  const std::string title =
      fmt::format("End poses of {} trials, measured and simulated", problem.log.trials.size());
  RETURN_IF_ERROR(
      write_file_atomically((store.run() / "poses.svg").string(),
                            pose_picture(pose_panels(problem, predictions), title,
                                         "Seen from the start, before and after evolution; "
                                         "ellipses hold 90 % of the simulated positions")));
  return baseline_note_of_run(beside);
}

// In place of the one that the run left when it last ended; one that it did not leave is kept.
Status replace_model(RunStore& store, const Model& model, RunWatcher& watcher) {
  const std::string file = (store.run() / "model.toml").string();
  ASSIGN_OR_RETURN(const auto reader, RunReader::open(store.run()));
  ASSIGN_OR_RETURN(const auto left, reader.document("model"));
  const auto quoted_hash = [](const std::string& s) { return '"' + content_hash(s) + '"'; };
  const Result<std::string> there = read_text_file(file);
  if (there && (!left || left->json != quoted_hash(*there))) {
    const std::string kept = file + "." + content_hash(*there).substr(0, 8);
    RETURN_IF_ERROR(write_file_atomically(kept, *there));
    watcher.note(file + " is not as this run left it; it is kept as " + kept);
  }
  RETURN_IF_ERROR(write_model(model, file));
  return store.keep_document("model", quoted_hash(format_model(model)));
}

Status write_pages(const RunStore& store, RunWatcher& watcher) {
  ASSIGN_OR_RETURN(const auto report, read_run_report({store.run(), {}, {}}));
  RETURN_IF_ERROR(
      write_file_atomically((store.run() / "fitness.svg").string(), fitness_chart(report)));
  if (const auto keys = keys_at_bounds(report.parameters); !keys.empty()) {
    watcher.note(
        fmt::format("at the end of its range in [genes]: {}; a better value may lie beyond",
                    fmt::join(keys, ", ")));
  }
  // Of the first one, which is everywhere; elites all score the same later on.
  if (!report.generations.empty()) {
    const RunGeneration& first = report.generations.front();
    if (first.evaluations > 1 && first.best && first.best == first.worst &&
        report.generations.back().best == first.best) {
      watcher.note("all scores are the same: nothing that was searched changed them");
    }
  }
  return write_file_atomically((store.run() / "report.html").string(), run_html(report));
}

}  // namespace

RunOutcome run_outcome(const Problem& problem, const PredictionOfLog* before,
                       const PredictionOfLog* after, const std::vector<ScoreRow>& validated) {
  const std::vector<DrivenCommand> driven = driven_commands(problem.log, problem.commands);
  const std::vector<TrialContext> contexts = trial_contexts(problem.log, driven);
  RunOutcome outcome;
  for (std::size_t i = 0; i < problem.log.trials.size(); ++i) {
    const Trial& logged = problem.log.trials[i];
    DiagnosedTrial trial;
    trial.session = logged.session;
    trial.trial = logged.trial;
    trial.command = logged.command;
    trial.session_time_s = contexts[i].session_time_s;
    trial.place_in_run = contexts[i].place_in_run;
    trial.duration_s = driven[i].duration_s;
    trial.level = std::max(std::abs(driven[i].left), std::abs(driven[i].right));
    trial.X_WS = logged.X_WS;
    trial.measured = between(logged.X_WS, logged.X_WE);
    const PredictedLogEnd first = predicted(before, i, logged), last = predicted(after, i, logged);
    trial.tuned = first.X_SE, trial.final_ = last.X_SE;
    trial.tuned_cov = first.cov, trial.final_cov = last.cov;
    trial.tuned_residual = first.residual, trial.final_residual = last.residual;
    trial.tuned_score = first.score, trial.final_score = last.score;
    outcome.trials.push_back(std::move(trial));
  }
  outcome.validation = validated;
  return outcome;
}

Result<std::optional<Problem>> held_out_of(const RunInfo& info, const Problem& problem) {
  Config config;
  config.path = info.config_path;
  config.text = info.config_text;
  config.problem = problem;
  if (problem.windows()) {
    ASSIGN_OR_RETURN(const auto read, parse_stored(info, problem));
    config.path = read.path;
    config.windows = read.windows;
    config.trial_files = read.trial_files;
  }
  ASSIGN_OR_RETURN(const auto plan, read_stages(config));
  return read_validation(plan, config);
}

Result<RunReport> read_run_report(const RunQuestion& question) {
  const std::filesystem::path& run = question.run;
  ASSIGN_OR_RETURN(const auto reader, RunReader::open(run));
  const RunInfo& info = reader.info();
  ASSIGN_OR_RETURN(const Problem problem, stored_problem(reader));
  ASSIGN_OR_RETURN(const auto generations, reader.generations());
  RunReport report;
  report.name = run.string();
  report.fitness = info.fitness;
  report.unit = info.fitness_unit;
  report.higher_is_better = info.higher_is_better;
  report.pieces = !problem.pieces.empty();
  double wall_s = 0;
  for (const StoredGeneration& g : generations) {
    wall_s += g.wall_s;
    report.generations.push_back({g.generation, g.best, g.median, g.worst, g.evaluations, wall_s});
  }
  const std::uint64_t last = generations.empty() ? 0 : generations.back().generation;
  ASSIGN_OR_RETURN(const auto best, reader.best());
  if (best) {
    ASSIGN_OR_RETURN(const auto individuals, reader.individuals(last));
    report.parameters = parameter_rows(problem, individuals, *best);
    add_determined(run / kDeterminedFile, &report.parameters);
  }
  report.objective = is_value(problem.fitness.kind);
  if (!report.objective) {
    ASSIGN_OR_RETURN(report.outcome, stored_outcome(reader, last, &report));
  }
  RETURN_IF_ERROR(add_history(reader, problem, generations, question, &report));
  const auto apart = held_out_of(info, problem);
  if (apart && *apart) report.held_out = (*apart)->log.trials.size();
  report.windows = problem.windows();
  report.headline = headline(report);
  report.action = action(report, info);
  report.provenance = {
      {"config", info.config_path},
      report.objective
          ? std::pair<std::string, std::string>("objective",
                                                joined(problem.external->command.argv, " "))
          : std::pair<std::string, std::string>("trials", std::to_string(report.trials)),
      {"problem", info.problem_hash},
      {"seed", std::to_string(info.seed)},
      {"begun", info.created},
      {"program", info.program_version + ", " + info.fingerprint}};
  if (!generations.empty()) {
    const StoredGeneration& g = generations.back();
    report.provenance.emplace_back("digest", g.digest);
    report.provenance.emplace_back("evaluations", std::to_string(g.evaluations));
    report.provenance.emplace_back(
        "best genome", best ? fmt::format("{}; gapfarm replay {} --genome {}", best->birth_id,
                                          run.string(), best->birth_id)
                            : "none");
  }
  return report;
}

std::vector<std::string> output_files(const Problem& problem) {
  if (is_value(problem.fitness.kind)) return {"model.toml", "report.html", "fitness.svg"};
  return {"model.toml", "report.html", "poses.svg", "fitness.svg"};
}

Status write_outputs(RunStore& store, const RunRequest& run, const std::optional<Problem>& held_out,
                     Farm& farm, RunWatcher& watcher, RunSummary* summary) {
  const Problem& problem = run.problem;
  const Genome& best = summary->evolved.best->genome;
  if (held_out) {
    watcher.read(held_out->log);
    ASSIGN_OR_RETURN(summary->validated, validate(store, *held_out, farm, best));
    summary->held_out = held_out->log.trials.size();
  }
  RETURN_IF_ERROR(replace_model(store, model_of(store, run, summary->evolved), watcher));
  std::string beside;
  if (!is_value(problem.fitness.kind)) {
    ASSIGN_OR_RETURN(beside, write_poses(store, problem, best, farm, summary->validated));
  }
  RETURN_IF_ERROR(write_pages(store, watcher));
  if (!beside.empty()) watcher.note(beside);
  summary->files = mapped(output_files(problem),
                          [&](const std::string& name) { return (store.run() / name).string(); });
  return {};
}

}  // namespace gapfarm
