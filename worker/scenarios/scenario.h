// Scenarios: what can be simulated.  The rest of the worker knows them by this interface only.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/random/stream.h"
#include "common/score/fitness.h"
#include "common/score/scale_mixture.h"
#include "gapfarm/v1/task.pb.h"
#include "worker/sim/robot/motion.h"
#include "worker/sim/step_counter.h"

namespace gapfarm {

// One way in which a trial may end.
struct Alternative {
  double weight = 1;
  Pose X_WM;                                      // mean of the measured end pose, world frame
  Eigen::Matrix3d cov = Eigen::Matrix3d::Zero();  // in X_WM's own axes: m, m, rad
  // The readings' part of it; only with tails (see Prediction).
  Eigen::Matrix3d reading_cov = Eigen::Matrix3d::Zero();
};

// The predictive distribution of a trial's measured end pose: a mixture whose weights sum to 1.
struct TrialPrediction {
  std::vector<Alternative> alternatives;
};

struct Prediction {
  v1::Outcome outcome = v1::OK;  // the first simulation that did not end well decides
  std::string message;
  std::vector<TrialPrediction> trials;  // as asked for
  NoiseTails tails;                     // of every trial's alternatives; covariances are the cores'
  std::vector<MotionFacts> facts;       // one a command of the problem
  unsigned conditions = 0;              // distinct motions that had to be simulated
};

// Of one motion that depends on them.
inline constexpr std::size_t kMostHeadings = 32;

struct PredictOptions {
  std::span<const std::uint32_t> trials;  // indices into the problem's log; empty: all
  bool means_only = false;                // one alternative a trial, no covariance
  bool planned = false;                   // the log's ends are of a robot without what is predicted
  // Of such a motion, even; 0: as many as it takes.  Where they are reported, times are few, too.
  std::size_t headings = 0;
  v1::StreamKey stream;          // only SpreadKind::kSampled draws from it
  StepCounter* steps = nullptr;  // counts the simulation's steps

  // The trials of so many that are asked for.
  std::vector<std::uint32_t> of(std::size_t count) const {
    std::vector<std::uint32_t> all(trials.begin(), trials.end());
    if (!trials.empty()) return all;
    all.resize(count);
    std::iota(all.begin(), all.end(), 0);
    return all;
  }
};

// A scenario with a problem's trials prepared for many genomes.  Const methods are pure; `steps`
// (may be null) shows that they advance.  Asked only for what the scenario's row says that it can.
class ScenarioModel {
 public:
  virtual ~ScenarioModel() = default;
  virtual Prediction predict(const ParameterValues&, const PredictOptions&) const { return {}; }
  // Instead of a prediction that is scored.
  virtual v1::TaskResult evaluate(const ParameterValues&, const v1::EvaluateTask&,
                                  StepCounter*) const {
    return {};
  }
  virtual v1::TaskResult simulate(const ParameterValues&, const v1::SimulateTask&,
                                  StepCounter*) const {
    return {};
  }
  virtual v1::TaskResult trace(const ParameterValues&, const v1::TraceTask&, StepCounter*) const {
    return {};
  }
};

struct Scenario {
  const char* name;
  const char* summary;
  // `problem` outlives the model.
  std::unique_ptr<ScenarioModel> (*prepare)(const Problem& problem);
};

std::span<const Scenario> scenarios();

// A Surveyor SRV-1 driving one atomic command from rest to rest, seen by an overhead camera.
std::unique_ptr<ScenarioModel> prepare_srv1(const Problem& problem);

// Flat pieces pushed across a table by a finger (Weitnauer, Haschke, Ritter 2010).
std::unique_ptr<ScenarioModel> prepare_push(const Problem& problem);

// Any robot on wheels or tracks, from its file, following the commands of logged runs; its trials
// are windows of the runs.
std::unique_ptr<ScenarioModel> prepare_ground(const Problem& problem);

// A program of the user's drives commands, or follows runs (docs/external.md).
std::unique_ptr<ScenarioModel> prepare_external(const Problem& problem);

// A number that a program of the user's makes of values (docs/objective.md).
std::unique_ptr<ScenarioModel> prepare_objective(const Problem& problem);

// A ball in a closed court, struck by a paddle.  It has paths and no trials: only trace() answers,
// predict() and simulate() say so.  A command's duties scale the launch: the mean of both is the
// share of the launch velocity.
std::unique_ptr<ScenarioModel> prepare_racquetball(const Problem& problem);

// Between simulations and the words of tasks and their results.

inline v1::Outcome to_outcome(MotionOutcome outcome) {
  constexpr v1::Outcome kOutcomes[] = {v1::OK, v1::DIVERGED, v1::FELL_OVER, v1::NEVER_RESTED};
  return kOutcomes[static_cast<std::size_t>(outcome)];
}

inline MotionFacts facts_of(const Motion& motion) {
  return {motion.max_roll_rad, motion.max_pitch_rad, motion.max_heave_m, motion.rest_time_s};
}

inline v1::TaskResult failed_task(v1::Outcome outcome, const std::string& message) {
  v1::TaskResult result;
  result.set_outcome(outcome);
  result.set_message(message);
  return result;
}

// The stream of a task's draws for this purpose; of one of its trials, `trial` in place of the
// replicate.
inline StreamKey stream_key(const v1::StreamKey& task, Purpose purpose, std::uint64_t trial) {
  return {task.run_seed(), purpose, task.generation(), task.birth_id(), trial};
}
inline StreamKey stream_key(const v1::StreamKey& task, Purpose purpose) {
  return stream_key(task, purpose, task.replicate());
}

// Of the `k`-th of what is drawn apart within one evaluation: its number shares a word with the
// replicate's, so that they draw independently.
inline StreamKey evaluation_key(const v1::StreamKey& task, std::size_t k) {
  return stream_key(task, Purpose::kEvaluation,
                    task.replicate() | static_cast<std::uint64_t>(k + 1) << 32);
}

// The noise of one reading.
inline Pose drawn_noise(const PoseNoise& noise, Stream& stream) {
  const double x = noise.position_m * stream.normal();
  const double y = noise.position_m * stream.normal();
  return {x, y, noise.heading_rad * stream.normal()};
}

// Choices are indices, integers are whole, booleans are 0 or 1.
template <typename Setting>
void put(double value, Setting& setting) {
  if constexpr (std::is_same_v<Setting, bool>) {
    setting = value != 0;
  } else if constexpr (std::is_enum_v<Setting>) {
    setting = static_cast<Setting>(static_cast<int>(value));
  } else {
    setting = static_cast<Setting>(value);
  }
}

}  // namespace gapfarm
