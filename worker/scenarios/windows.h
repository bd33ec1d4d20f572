// Windows of runs as trials: whoever simulates a run, its ends are scored alike.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "worker/scenarios/scenario.h"
#include "worker/sim/robot/ground.h"

namespace gapfarm {

// What simulates runs, with a genome's values in it.
struct WindowRobot {
  Pose X_RM;  // of the tracked point
  // As GroundSimulator::run().
  std::function<GroundMotion(std::span<const CommandRow> commands, const GroundStart& start,
                             std::span<const double> times)>
      run;
};

class WindowModel : public ScenarioModel {
 public:
  explicit WindowModel(const Problem& problem);

  Prediction predict(const ParameterValues& values, const PredictOptions& options) const override;

 protected:
  virtual WindowRobot robot_at(const ParameterValues& values,
                               const PredictOptions& options) const = 0;
  double at(const ParameterValues& values, const char* key) const;

  const Problem& problem_;

 private:
  TrialPrediction observe(const ParameterValues& values, const Pose& X_RM,
                          const GroundMotion& motion, const Trial& trial, bool means_only) const;

  std::vector<std::vector<double>> times_;  // of each run
};

}  // namespace gapfarm
