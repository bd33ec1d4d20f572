#include "worker/sim/robot/ground.h"

#include <memory>

#include "worker/scenarios/scenario.h"
#include "worker/scenarios/windows.h"

namespace gapfarm {
namespace {

class GroundModel final : public WindowModel {
 public:
  using WindowModel::WindowModel;

 private:
  WindowRobot robot_at(const ParameterValues& values,
                       const PredictOptions& options) const override {
    const GroundRobot robot = problem_.ground->robot_at(values);
    const auto cross_load = problem_.table().find("cross_load");  // of four wheels only
    const GroundWorld world{at(values, kGroundGravity),
                            at(values, kGroundStepRate),
                            static_cast<int>(at(values, kGroundSolverIterations)),
                            at(values, kGroundCreep),
                            at(values, "creep_speed"),
                            cross_load ? values[*cross_load] : 0};
    const auto simulator = std::make_shared<GroundSimulator>(robot, world, options.steps);
    return {robot.X_RM, [simulator](auto commands, const GroundStart& start, auto times) {
              return simulator->run(commands, start, times);
            }};
  }
};

}  // namespace

std::unique_ptr<ScenarioModel> prepare_ground(const Problem& problem) {
  return std::make_unique<GroundModel>(problem);
}

}  // namespace gapfarm
