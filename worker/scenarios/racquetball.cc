#include "worker/scenarios/racquetball.h"

#include "common/parameters/racquetball.h"
#include "common/random/stream.h"
#include "worker/sim/racquetball.h"

namespace gapfarm {
namespace {

constexpr const char* kNoTrials =
    "scenario racquetball has paths and no trials: nothing can be predicted or logged; use gapfarm "
    "influence";

RacquetballSettings settings_of(const ParameterValues& values) {
  const auto at = [&](Racquetball p) { return values[row_of(p)]; };
  using enum Racquetball;
  RacquetballSettings s;
  s.gravity_m_s2 = at(kGravity);
  s.step_rate_hz = at(kStepRate);
  s.sub_steps = static_cast<int>(at(kSubSteps));
  s.solver_iterations = static_cast<int>(at(kSolverIterations));
  s.radius_m = at(kBallRadius);
  s.mass_kg = at(kBallMass);
  s.inertia_factor = at(kInertiaFactor);
  s.restitution = at(kBallRestitution);
  s.friction = at(kBallFriction);
  s.rolling_friction_m = at(kRollingFriction);
  s.anisotropic_friction = at(kAnisotropicFriction);
  s.wall_restitution = at(kWallRestitution);
  s.wall_friction = at(kWallFriction);
  s.linear_damping = at(kLinearDamping);
  s.angular_damping = at(kAngularDamping);
  s.maximum_velocity_m_s = at(kMaximumVelocity);
  s.shape = static_cast<BallShape>(static_cast<int>(at(kCollisionShape)));
  s.contact_response = at(kContactResponse) != 0;
  s.continuous = at(kContinuous) != 0;
  s.error_reduction = at(kErrorReduction);
  s.sleeping = at(kSleeping) != 0;
  s.sleep_linear_m_s = at(kSleepLinear);
  s.sleep_angular_rad_s = at(kSleepAngular);
  s.launch_m_s = {at(kLaunchSpeed), at(kLaunchSide), at(kLaunchLift)};
  s.launch_spin_rad_s = at(kLaunchSpin);
  s.launch_force_n = at(kLaunchForce);
  s.paddle_speed_m_s = at(kPaddleSpeed);
  s.paddle_tilt_rad = at(kPaddleTilt);
  s.paddle_size_m = at(kPaddleSize);
  s.paddle_spin_rad_s = at(kPaddleSpin);
  return s;
}

v1::TaskResult no_trials() {
  v1::TaskResult result;
  result.set_outcome(v1::INVALID_REQUEST);
  result.set_message(kNoTrials);
  return result;
}

class RacquetballModel final : public ScenarioModel {
 public:
  Prediction predict(const ParameterValues&, const PredictOptions&) const override {
    Prediction prediction;
    prediction.outcome = v1::INVALID_REQUEST;
    prediction.message = kNoTrials;
    return prediction;
  }

  v1::TaskResult simulate(const ParameterValues&, const v1::SimulateTask&,
                          StepCounter*) const override {
    return no_trials();
  }

  v1::TaskResult trace(const ParameterValues& values, const v1::TraceTask& task,
                       StepCounter* steps) const override {
    RacquetballSettings settings = settings_of(values);
    settings.launch_m_s *= (task.command().left() + task.command().right()) / 2;
    if (task.noisy()) {
      Stream stream({task.stream().run_seed(), Purpose::kSimulation, task.stream().generation(),
                     task.stream().birth_id(), task.stream().replicate()});
      for (double& x : settings.start_m) {
        x += values[row_of(Racquetball::kStartNoise)] * stream.normal();
      }
      for (double& v : settings.launch_m_s) {
        v += values[row_of(Racquetball::kLaunchNoise)] * stream.normal();
      }
    }
    const BallFlight flight = fly_ball(settings, task.command().duration(), task.interval(), steps);
    v1::TaskResult result;
    result.set_outcome(flight.diverged ? v1::DIVERGED : v1::OK);
    result.set_simulated(task.command().duration());
    for (const BallSample& ball : flight.path) {
      v1::TraceSample* sample = result.mutable_trace()->add_samples();
      sample->set_t(ball.t_s);
      sample->mutable_pose()->set_x(ball.position_m.x());
      sample->mutable_pose()->set_y(ball.position_m.y());
      sample->set_height(ball.position_m.z());
    }
    return result;
  }
};

}  // namespace

std::unique_ptr<ScenarioModel> prepare_racquetball(const Problem&) {
  return std::make_unique<RacquetballModel>();
}

}  // namespace gapfarm
