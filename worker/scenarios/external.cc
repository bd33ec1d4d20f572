// A user's program behind a scenario (docs/external.md, docs/objective.md).
#include <poll.h>

#include <cmath>
#include <exception>
#include <string>

#include "common/base/clock.h"
#include "common/base/text.h"
#include "common/external/simulator.h"
#include "common/random/stream.h"
#include "worker/scenarios/scenario.h"
#include "worker/scenarios/srv1/srv1_robot.h"
#include "worker/scenarios/windows.h"

namespace gapfarm {
namespace {

// Problems of one program share the process: it is started once, and costs what it costs.  One a
// thread, because its answers are in the order of what it is asked.
std::shared_ptr<ExternalSimulator> shared_simulator(const ExternalCommand& command) {
  struct Started {
    ExternalCommand command;
    std::weak_ptr<ExternalSimulator> simulator;
  };
  static thread_local std::vector<Started> all;
  std::erase_if(all, [](const Started& one) { return one.simulator.expired(); });
  for (const Started& one : all) {
    if (one.command == command) return one.simulator.lock();
  }
  auto simulator = std::make_shared<ExternalSimulator>(command, monotonic_seconds);
  all.push_back({command, simulator});
  return simulator;
}

// WORKER_UNFIT where this worker may not start what a master names.
std::optional<v1::TaskResult> refuse_to_start() {
  if (external_programs_allowed()) return std::nullopt;
  return failed_task(
      v1::WORKER_UNFIT,
      "this worker starts no programs that a master names; start it with --allow-external, and "
      "only for a master that you trust with its machine");
}

// What an answer that is not there says: of this worker, or of the task.
v1::Outcome outcome_of(const Error& error) {
  return error.code == ErrorCode::kNoProgram ? v1::WORKER_UNFIT : v1::WORKER_FAILED;
}

// A machine may lack memory or processes for a moment: a program is started as often as a task may
// end workers (JobLimits), with the waits of ProcessPoolOptions.
constexpr int kMostStarts = 3;
constexpr int kStartAgain_ms = 100;

// ExternalSimulator::simulate().  `steps` advance while the program computes, since it has a limit
// of its own.
template <class Request>
auto ask_program(ExternalSimulator& simulator, Request& request, const ExternalProgram& program,
                 StepCounter* steps) {
  simulator.while_waiting([steps] { count_step(steps); });
  auto answer = simulator.simulate(request, program.introduction);
  for (int starts = 1; starts < kMostStarts; ++starts) {
    if (answer || answer.error().code != ErrorCode::kNoProgram) break;
    poll(nullptr, 0, starts * kStartAgain_ms);
    answer = simulator.simulate(request, program.introduction);
  }
  count_step(steps);
  return answer;
}

class ExternalFailure : public std::exception {
 public:
  explicit ExternalFailure(Error error) : error_(std::move(error)) {}
  const char* what() const noexcept override { return error_.message.c_str(); }
  v1::Outcome outcome() const { return outcome_of(error_); }

 private:
  Error error_;
};

// What to say of an answer without a motion.
std::string refusal_of(const ExternalProgram& program, const std::string& message) {
  return "external program '" + joined(program.command.argv, " ") + "' diverged" +
         (message.empty() ? " and does not say why" : ": " + message);
}

ExternalSide external_side(const SideDrive& side) {
  return {side.speed_m_s, side.lag_s, side.dead_travel_m};
}

class ExternalVehicle final : public Vehicle {
 public:
  ExternalVehicle(const Problem& problem, const ParameterValues& values, StepCounter* steps)
      : problem_(problem), simulator_(shared_simulator(problem.external->command)), steps_(steps) {
    request_.declaration = &problem.external->table.declaration();
    request_.values.assign(values.begin(),
                           values.begin() + request_.declaration->parameters.size());
  }

  Motion run(const DriveInput& drive, const Floor& floor, std::vector<MotionSample>* path,
             double interval_s) override {
    request_.left = external_side(drive.left);
    request_.right = external_side(drive.right);
    request_.duration_s = drive.duration_s;
    request_.interval_s = path == nullptr ? 0 : interval_s;
    const FrictionDisc& patch = floor.patches.front();
    request_.floor = {floor.tilt_rad,
                      floor.tilt_direction_rad,
                      floor.nap_strength,
                      floor.nap_direction_rad,
                      floor.rolling_resistance,
                      patch.x_m,
                      patch.y_m,
                      patch.radius_m,
                      patch.ratio};
    if (path != nullptr && !(request_.declaration->inputs & kExternalPath)) {
      throw ExternalFailure({"external program '" + request_.declaration->name +
                             "' does not declare the input \"path\": there are only end poses"});
    }
    const auto answer = ask_program(*simulator_, request_, *problem_.external, steps_);
    if (!answer) throw ExternalFailure(answer.error());
    Motion motion;
    if (answer->diverged) {
      motion.outcome = MotionOutcome::kDiverged;
      motion.message = refusal_of(*problem_.external, answer->message);
    }
    motion.X_SE = answer->X_SE;
    motion.rest_time_s = answer->rest_time_s;
    motion.duration_s = drive.duration_s + answer->rest_time_s;
    if (path == nullptr) return motion;
    path->clear();
    for (const ExternalSample& s : answer->path) path->push_back({s.t_s, s.X_SB, 0, 0});
    return motion;
  }

 private:
  const Problem& problem_;
  std::shared_ptr<ExternalSimulator> simulator_;
  StepCounter* steps_;
  ExternalRequest request_;
};

// Follows the commands of runs; its poses are those of its own origin.
class ExternalRuns final : public WindowModel {
 public:
  explicit ExternalRuns(const Problem& problem)
      : WindowModel(problem), simulator_(shared_simulator(problem.external->command)) {}

 private:
  WindowRobot robot_at(const ParameterValues& values,
                       const PredictOptions& options) const override {
    const ExternalDeclaration& declaration = problem_.external->table.declaration();
    ExternalRunRequest request;
    request.declaration = &declaration;
    request.values.assign(values.begin(), values.begin() + declaration.parameters.size());
    const double delay_s = at(values, "delay");
    std::vector<double> gains, offsets;
    for (const std::string& channel : declaration.channels) {
      gains.push_back(at(values, (channel + kChannelGain).c_str()));
      offsets.push_back(at(values, (channel + kChannelOffset).c_str()));
    }
    const auto run = [this, request, delay_s, gains, offsets, steps = options.steps](
                         std::span<const CommandRow> commands, const GroundStart& start,
                         std::span<const double> times) mutable {
      request.start_s = start.t_s;
      request.speed_m_s = start.twist.vx_m_s;
      request.turn_rad_s = start.twist.omega_rad_s;
      request.commands.assign(commands.begin(), commands.end());
      for (CommandRow& row : request.commands) {
        row.t_s += delay_s;
        for (std::size_t c = 0; c < gains.size(); ++c) {
          row.values[c] = gains[c] * row.values[c] + offsets[c];
        }
      }
      request.times_s = times;
      const auto answer = ask_program(*simulator_, request, *problem_.external, steps);
      if (!answer) throw ExternalFailure(answer.error());
      GroundMotion motion = motion_of(*answer, times);
      if (answer->diverged) motion.message = refusal_of(*problem_.external, answer->message);
      return motion;
    };
    return {{at(values, "marker.x"), at(values, "marker.y"), at(values, "marker.yaw")}, run};
  }

  // Its way stands in for that of wheels, which it does not answer.
  static GroundMotion motion_of(const ExternalRunAnswer& answer, std::span<const double> times) {
    GroundMotion motion;
    motion.outcome = answer.diverged ? MotionOutcome::kDiverged : MotionOutcome::kOk;
    Pose before;
    double travel_m = 0;
    for (std::size_t k = 0; k < answer.poses.size(); ++k) {
      const Pose& X_SR = answer.poses[k];
      travel_m += std::hypot(X_SR.x - before.x, X_SR.y - before.y);
      motion.samples.push_back({times[k], X_SR, travel_m});
      before = X_SR;
    }
    return motion;
  }

  std::shared_ptr<ExternalSimulator> simulator_;
};

// What fails is this worker's failure and nobody's motion.
class ExternalModel final : public ScenarioModel {
 public:
  // Commands and effects of one from rest to rest are those of srv1.
  explicit ExternalModel(const Problem& problem)
      : keeps_program_(shared_simulator(problem.external->command)),
        model_(problem.windows() ? std::make_unique<ExternalRuns>(problem)
                                 : prepare_srv1(problem)) {}

  Prediction predict(const ParameterValues& values, const PredictOptions& options) const override {
    Prediction prediction;
    const v1::TaskResult failed = guarded([&] {
      prediction = model_->predict(values, options);
      return v1::TaskResult();
    });
    if (failed.outcome() == v1::OUTCOME_UNSPECIFIED) return prediction;
    prediction.outcome = failed.outcome();
    prediction.message = failed.message();
    return prediction;
  }

  v1::TaskResult simulate(const ParameterValues& values, const v1::SimulateTask& task,
                          StepCounter* steps) const override {
    return guarded([&] { return model_->simulate(values, task, steps); });
  }

  v1::TaskResult trace(const ParameterValues& values, const v1::TraceTask& task,
                       StepCounter* steps) const override {
    return guarded([&] { return model_->trace(values, task, steps); });
  }

 private:
  template <class Work>
  static v1::TaskResult guarded(const Work& work) {
    if (auto refusal = refuse_to_start()) return *refusal;
    try {
      return work();
    } catch (const ExternalFailure& failure) {
      return failed_task(failure.outcome(), failure.what());
    }
  }

  std::shared_ptr<ExternalSimulator> keeps_program_;
  std::unique_ptr<ScenarioModel> model_;
};

// Without noise one seed a run: what a program draws is the same whatever its values, so that no
// set of values is better by luck.
std::uint32_t seed_of(const v1::StreamKey& key, bool noisy) {
  StreamKey drawn{key.run_seed(), Purpose::kEvaluation, 0, 0, 0};
  if (noisy) drawn = {key.run_seed(), Purpose::kEvaluation, 0, key.birth_id(), key.replicate()};
  return static_cast<std::uint32_t>(Stream(drawn).bits());
}

class ObjectiveModel final : public ScenarioModel {
 public:
  explicit ObjectiveModel(const Problem& problem)
      : problem_(problem), program_(shared_simulator(problem.external->command)) {}

  v1::TaskResult evaluate(const ParameterValues& values, const v1::EvaluateTask& task,
                          StepCounter* steps) const override {
    if (auto refusal = refuse_to_start()) return *refusal;
    ExternalRequest request;
    request.declaration = &problem_.external->table.declaration();
    request.values = values;
    for (const SearchedObjective& objective : problem_.fitness.objectives) {
      request.objectives.push_back(objective.name);
    }
    request.seed = seed_of(task.stream(), problem_.spread.kind == SpreadKind::kSampled);
    const auto answer = ask_program(*program_, request, *problem_.external, steps);
    v1::TaskResult result;
    result.set_message(answer ? answer->message : answer.error().message);
    if (!answer) {
      result.set_outcome(outcome_of(answer.error()));
    } else if (answer->diverged) {
      result.set_outcome(v1::DIVERGED);
    } else {
      result.set_outcome(answer->violation > 0 ? v1::INFEASIBLE : v1::OK);
      result.mutable_evaluate()->set_fitness(answer->value);
      result.mutable_evaluate()->set_penalty(answer->violation);
      result.mutable_evaluate()->mutable_objectives()->Add(answer->values.begin(),
                                                           answer->values.end());
      result.mutable_evaluate()->set_conditions(1);
    }
    return result;
  }

 private:
  const Problem& problem_;
  std::shared_ptr<ExternalSimulator> program_;
};

}  // namespace

std::unique_ptr<ScenarioModel> prepare_external(const Problem& problem) {
  return std::make_unique<ExternalModel>(problem);
}

std::unique_ptr<Vehicle> make_external_vehicle(const Problem& problem,
                                               const ParameterValues& values, StepCounter* steps) {
  return std::make_unique<ExternalVehicle>(problem, values, steps);
}

std::unique_ptr<ScenarioModel> prepare_objective(const Problem& problem) {
  return std::make_unique<ObjectiveModel>(problem);
}

}  // namespace gapfarm
