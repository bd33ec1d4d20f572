#include "worker/sim/racquetball.h"

#include "common/parameters/table.h"
#include "common/random/stream.h"
#include "worker/scenarios/scenario.h"

namespace gapfarm {
namespace {

RacquetballSettings settings_of(const ParameterValues& values) {
  RacquetballSettings s;
#define ROW(name, row)
#define SETTING(name, member, row) put(values[row_of(Racquetball::name)], s.member);
#include "common/parameters/racquetball_rows.inc"
  return s;
}

class RacquetballModel final : public ScenarioModel {
 public:
  v1::TaskResult trace(const ParameterValues& values, const v1::TraceTask& task,
                       StepCounter* steps) const override {
    RacquetballSettings settings = settings_of(values);
    settings.launch_m_s *= (task.command().left() + task.command().right()) / 2;
    if (task.noisy()) {
      Stream stream(stream_key(task.stream(), Purpose::kSimulation));
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
