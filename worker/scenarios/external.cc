#include <cmath>
#include <exception>
#include <string>

#include "worker/scenarios/program.h"
#include "worker/scenarios/scenario.h"
#include "worker/scenarios/srv1/srv1_robot.h"
#include "worker/scenarios/windows.h"

namespace gapfarm {
namespace {

class ExternalFailure : public std::exception {
 public:
  explicit ExternalFailure(Error error) : error_(std::move(error)) {}
  const char* what() const noexcept override { return error_.message.c_str(); }
  v1::Outcome outcome() const { return outcome_of(error_); }

 private:
  Error error_;
};

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
      return motion_of(*answer, start, times);
    };
    return {{at(values, "marker.x"), at(values, "marker.y"), at(values, "marker.yaw")}, run};
  }

  // Its way stands in for that of wheels, which it does not answer.
  static GroundMotion motion_of(const ExternalRunAnswer& answer, const GroundStart& start,
                                std::span<const double> times) {
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
    if (!times.empty()) motion.simulated_s = times.back() - start.t_s;
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
    if (const auto refusal = refuse_to_start()) {
      prediction.outcome = refusal->outcome();
      prediction.message = refusal->message();
      return prediction;
    }
    try {
      return model_->predict(values, options);
    } catch (const ExternalFailure& failure) {
      prediction.outcome = failure.outcome();
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

}  // namespace

std::unique_ptr<ScenarioModel> prepare_external(const Problem& problem) {
  return std::make_unique<ExternalModel>(problem);
}

std::unique_ptr<Vehicle> make_external_vehicle(const Problem& problem,
                                               const ParameterValues& values, StepCounter* steps) {
  return std::make_unique<ExternalVehicle>(problem, values, steps);
}

}  // namespace gapfarm
