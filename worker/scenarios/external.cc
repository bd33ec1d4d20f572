#include <algorithm>
#include <exception>
#include <string>

#include "common/external/simulator.h"
#include "common/process/process_pool.h"
#include "worker/scenarios/scenarios.h"
#include "worker/scenarios/srv1/motion_memo.h"

namespace gapfarm {
namespace {

class ExternalFailure : public std::exception {
 public:
  explicit ExternalFailure(std::string message) : message_(std::move(message)) {}
  const char* what() const noexcept override { return message_.c_str(); }

 private:
  std::string message_;
};

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

ExternalSide external_side(const SideDrive& side) {
  return {side.speed_m_s, side.lag_s, side.dead_travel_m};
}

class ExternalVehicle final : public Vehicle {
 public:
  ExternalVehicle(const Problem& problem, const ParameterValues& values, StepCounter* steps)
      : problem_(problem), simulator_(shared_simulator(problem.external->command)), steps_(steps) {
    request_.declaration = &problem.external->table.declaration();
    request_.values.assign(
        values.begin(),
        values.begin() + static_cast<std::ptrdiff_t>(request_.declaration->parameters.size()));
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
      throw ExternalFailure("external program '" + request_.declaration->name +
                            "' does not declare the input \"path\": there are only end poses");
    }
    const Result<ExternalAnswer> answer =
        simulator_->simulate(request_, problem_.external->introduction);
    if (!answer) throw ExternalFailure(answer.error().message);
    count_step(steps_);
    Motion motion;
    motion.outcome = answer->diverged ? MotionOutcome::kDiverged : MotionOutcome::kOk;
    motion.X_SE = answer->X_SE;
    motion.rest_time_s = answer->rest_time_s;
    motion.duration_s = drive.duration_s + answer->rest_time_s;
    if (path == nullptr) return motion;
    path->clear();
    for (const ExternalSample& s : answer->path) path->push_back({s.t_s, s.X_SB, 0, 0, 0, 0});
    return motion;
  }

 private:
  const Problem& problem_;
  std::shared_ptr<ExternalSimulator> simulator_;
  StepCounter* steps_;
  ExternalRequest request_;
};

// Commands and effects are those of srv1; what fails is this worker's failure and nobody's motion.
class ExternalModel final : public ScenarioModel {
 public:
  explicit ExternalModel(const Problem& problem)
      : keeps_program_(shared_simulator(problem.external->command)),
        model_(prepare_srv1(problem)) {}

  Prediction predict(const ParameterValues& values, const PredictOptions& options) const override {
    Prediction prediction;
    if (!may_start(&prediction.message)) {
      prediction.outcome = v1::INVALID_REQUEST;
      return prediction;
    }
    try {
      return model_->predict(values, options);
    } catch (const ExternalFailure& failure) {
      prediction.outcome = v1::WORKER_FAILED;
      prediction.message = failure.what();
    }
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
  static bool may_start(std::string* why) {
    if (external_programs_allowed()) return true;
    *why =
        "this worker starts no programs that a master names; start it with --allow-external, and "
        "only for a master that you trust with its machine";
    return false;
  }

  template <class Work>
  static v1::TaskResult guarded(const Work& work) {
    v1::TaskResult result;
    if (std::string why; !may_start(&why)) {
      result.set_outcome(v1::INVALID_REQUEST);
      result.set_message(why);
      return result;
    }
    try {
      return work();
    } catch (const ExternalFailure& failure) {
      result.set_outcome(v1::WORKER_FAILED);
      result.set_message(failure.what());
    }
    return result;
  }

  std::shared_ptr<ExternalSimulator> keeps_program_;
  std::unique_ptr<ScenarioModel> model_;
};

}  // namespace

std::unique_ptr<ScenarioModel> prepare_external(const Problem& problem) {
  return std::make_unique<ExternalModel>(problem);
}

std::unique_ptr<Vehicle> make_external_vehicle(const Problem& problem,
                                               const ParameterValues& values, StepCounter* steps) {
  return std::make_unique<ExternalVehicle>(problem, values, steps);
}

}  // namespace gapfarm
