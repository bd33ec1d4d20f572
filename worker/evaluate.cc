#include "worker/evaluate.h"

#include <chrono>
#include <cmath>
#include <exception>
#include <utility>

#include "common/base/hash.h"
#include "common/problem/message_parts.h"
#include "common/score/motion_model.h"
#include "worker/fitness.h"
#include "worker/scenarios/scenario.h"

namespace gapfarm {
namespace {

class Prepared : public PreparedProblem {
 public:
  Prepared(Problem problem, const Scenario& scenario)
      : problem_(std::move(problem)), model_(scenario.prepare(problem_)) {
    if (!problem_.residual.empty()) facts_ = logged_motions(problem_);
  }

  const Problem& problem() const override { return problem_; }
  const ScenarioModel& model() const { return *model_; }
  // The model's, with the problem's correction.
  Prediction predict(const ParameterValues& values, const PredictOptions& options) const {
    Prediction prediction = model_->predict(values, options);
    if (problem_.residual.empty()) return prediction;
    for (std::size_t k = 0; k < prediction.trials.size(); ++k) {
      const LoggedMotion& facts = facts_[options.trials.empty() ? k : options.trials[k]];
      correct(facts, &prediction.trials[k]);
    }
    return prediction;
  }
  // Outliers lie about every alternative of the model's.
  void correct(const LoggedMotion& facts, TrialPrediction* trial) const {
    const Residual& residual = problem_.residual;
    std::vector<Alternative> all;
    for (Alternative& alternative : trial->alternatives) {
      alternative.X_WM = corrected_end(residual.field, facts, alternative.X_WM);
      if (!residual.outliers) continue;
      for (const OutlierMode& outlier :
           outlier_modes(*residual.outliers, facts, alternative.X_WM)) {
        Alternative& added = all.emplace_back(alternative);
        added.weight *= outlier.weight;
        added.X_WM = outlier.X_WE;
        added.cov += outlier.spread * outlier.spread.transpose();
      }
    }
    if (residual.outliers) trial->alternatives = std::move(all);
  }
  const FitnessReference& reference() const { return reference_; }
  void set_reference(FitnessReference reference) { reference_ = std::move(reference); }

 private:
  Problem problem_;
  std::unique_ptr<ScenarioModel> model_;
  std::vector<LoggedMotion> facts_;  // one a trial, where there is a correction
  FitnessReference reference_;
};

v1::TaskResult invalid(const std::string& message) {
  return failed_task(v1::INVALID_REQUEST, message);
}

Result<ParameterValues> values_at(const Problem& problem, const v1::Point& point) {
  const Genome genome(point.genome().begin(), point.genome().end());
  if (!genome.empty() && genome.size() != problem.genes.size()) {
    return Error{"a genome of " + std::to_string(genome.size()) + " genes, but the problem has " +
                 std::to_string(problem.genes.size())};
  }
  for (double g : genome) {
    if (!(g >= 0 && g <= 1)) return Error{"a gene of " + std::to_string(g) + " is not in [0, 1]"};
  }
  ParameterValues values = problem.values_of(genome);
  for (const v1::Override& override : point.overrides()) {
    if (override.parameter() >= values.size()) {
      return Error{"an override of parameter row " + std::to_string(override.parameter()) +
                   ", but the table has " + std::to_string(values.size())};
    }
    RETURN_IF_ERROR(problem.table().check(override.parameter(), override.value()));
    values[override.parameter()] = override.value();
  }
  return values;
}

v1::TaskResult run(const Prepared& p, const ParameterValues& values, const v1::EvaluateTask& task,
                   StepCounter* steps) {
  if (scenario_form(p.problem().scenario).objective) return p.model().evaluate(values, task, steps);
  PredictOptions options;
  options.stream = task.stream();
  options.steps = steps;
  options.means_only = compares_means(p.problem().fitness.kind);
  const Prediction prediction = p.predict(values, options);
  if (prediction.outcome != v1::OK) return failed_task(prediction.outcome, prediction.message);
  auto fitness = fitness_of(p.problem(), p.reference(), prediction);
  if (!fitness) return failed_task(v1::DIVERGED, fitness.error().message);
  v1::TaskResult result;
  result.set_outcome(v1::OK);
  *result.mutable_evaluate() = *fitness;
  return result;
}

void write_covariance(const Eigen::Matrix3d& cov, v1::Predicted* to) {
  for (const auto& [row, column] : {std::pair{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}) {
    to->add_cov(cov(row, column));
  }
}

v1::TaskResult run(const Prepared& p, const ParameterValues& values, const v1::PredictTask& task,
                   StepCounter* steps) {
  const auto& trials = p.problem().log.trials;
  for (std::uint32_t i : task.trials()) {
    if (i >= trials.size()) return invalid("there is no trial " + std::to_string(i));
  }
  if (task.headings() % 2 != 0 || task.headings() > kMostHeadings) {
    return invalid("motions are simulated at an even number of headings up to " +
                   std::to_string(kMostHeadings) + ", not at " + std::to_string(task.headings()));
  }
  PredictOptions options;
  options.trials = {task.trials().data(), static_cast<std::size_t>(task.trials_size())};
  options.means_only = task.means_only();
  options.planned = task.planned();
  options.headings = task.headings();
  options.stream = task.stream();
  options.steps = steps;
  const Prediction prediction = p.predict(values, options);
  if (prediction.outcome != v1::OK) return failed_task(prediction.outcome, prediction.message);
  v1::TaskResult result;
  result.set_outcome(v1::OK);
  const TailedDensity density(prediction.tails);
  for (std::size_t k = 0; k < prediction.trials.size(); ++k) {
    const std::uint32_t i =
        options.trials.empty() ? static_cast<std::uint32_t>(k) : options.trials[k];
    v1::Predicted* to = result.mutable_predict()->add_predictions();
    to->set_trial(i);
    const Alternative whole = collapsed(prediction.trials[k]);
    *to->mutable_end() = to_proto(whole.X_WM);
    if (options.means_only) continue;
    write_covariance(whole.cov, to);
    const auto score = log_score_of(prediction.trials[k], density, trials[i].X_WE,
                                    p.problem().fitness.outlier_share);
    if (!score) return failed_task(v1::DIVERGED, score.error().message);
    to->set_log_score(*score);
  }
  return result;
}

v1::TaskResult run(const Prepared& p, const ParameterValues& values, const v1::SimulateTask& task,
                   StepCounter* steps) {
  for (const v1::PlannedTrial& planned : task.plan()) {
    const Status s = check_trial(from_proto(planned.trial()), p.problem());
    if (!s) return invalid("a plan's " + s.error().message);
  }
  const double interval = task.path_interval();
  if (!(interval == 0 || interval >= kLeastPathInterval_s)) {
    return invalid("a plan's path interval is 0 (no path) or at least 0.0001 s");
  }
  return p.model().simulate(values, task, steps);
}

v1::TaskResult run(const Prepared& p, const ParameterValues& values, const v1::TraceTask& task,
                   StepCounter* steps) {
  if (const Status s = check_command(task.command()); !s) return invalid(s.error().message);
  if (!(task.interval() >= kLeastPathInterval_s)) {
    return invalid("a trace needs an interval of at least 0.0001 s");
  }
  if (!p.problem().residual.empty()) {
    return invalid(
        "a traced command has no place, heading or time, which the problem's residual looks at; "
        "trace without it");
  }
  return p.model().trace(values, task, steps);
}

// Answers with its payload after computing for a while; what it computes is thrown away.
v1::TaskResult echo(const v1::EchoTask& task, StepCounter* steps) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::microseconds(task.busy_us());
  while (std::chrono::steady_clock::now() < until) count_step(steps);
  v1::TaskResult result;
  result.set_outcome(v1::OK);
  result.set_echo(task.payload());
  return result;
}

template <class T>
v1::TaskResult at_point(const Prepared& prepared, unsigned needed, const T& task,
                        StepCounter* steps) {
  const Status can = check_can(prepared.problem().scenario, needed);
  if (!can.ok()) return invalid(can.error().message);
  const auto values = values_at(prepared.problem(), task.point());
  if (!values) return invalid(values.error().message);
  return run(prepared, *values, task, steps);
}

v1::TaskResult dispatch(const Prepared* prepared, const v1::Task& task, StepCounter* steps) {
  if (task.kind_case() == v1::Task::kEcho) return echo(task.echo(), steps);
  if (prepared == nullptr) return invalid("the task needs a problem");
  switch (task.kind_case()) {
    case v1::Task::kEvaluate:
      return at_point(*prepared, kPredicts | kEvaluates, task.evaluate(), steps);
    case v1::Task::kPredict:
      return at_point(*prepared, kPredicts, task.predict(), steps);
    case v1::Task::kSimulate:
      return at_point(*prepared, kSimulates, task.simulate(), steps);
    case v1::Task::kTrace:
      return at_point(*prepared, kTraces, task.trace(), steps);
    default:
      return invalid("a task of unknown kind; master and worker must be the same build");
  }
}

std::string golden_simulation() {
  Problem problem;
  problem.values = problem.table().nominal();
  problem.commands = default_commands(problem.scenario);
  const auto prepared = prepare(to_proto(problem));
  Hasher hasher;
  for (const CommandSpec& command : problem.commands) {
    v1::Task task;
    v1::Command* c = task.mutable_trace()->mutable_command();
    c->set_name(command.name);
    c->set_left(command.left);
    c->set_right(command.right);
    c->set_duration(0.2);
    task.mutable_trace()->set_interval(0.1);
    const v1::TaskResult result = evaluate(prepared->get(), task);
    for (const v1::TraceSample& sample : result.trace().samples()) {
      hasher.add(sample.pose().x()).add(sample.pose().y()).add(sample.pose().theta());
    }
  }
  return hasher.finish();
}

}  // namespace

Result<std::unique_ptr<PreparedProblem>> prepare(const v1::Problem& message) {
  ASSIGN_OR_RETURN(auto problem, from_proto(message));
  for (const Scenario& scenario : scenarios()) {
    if (problem.scenario != scenario.name) continue;
    auto prepared = std::make_unique<Prepared>(std::move(problem), scenario);
    if (!prepared->problem().log.trials.empty()) {
      ASSIGN_OR_RETURN(auto reference, fitness_reference(prepared->problem()));
      prepared->set_reference(std::move(reference));
    }
    return std::unique_ptr<PreparedProblem>(std::move(prepared));
  }
  return Error{"scenario '" + problem.scenario + "' has no simulation in this build"};
}

v1::TaskResult evaluate(const PreparedProblem* prepared, const v1::Task& task, StepCounter* steps) {
  // Nothing of ours throws; a library out of memory may.
  try {
    return dispatch(static_cast<const Prepared*>(prepared), task, steps);
  } catch (const std::exception& e) {
    return invalid(std::string("exception: ") + e.what());
  }
}

const std::string& numeric_class() {
  static const std::string hash = golden_simulation();
  return hash;
}

}  // namespace gapfarm
