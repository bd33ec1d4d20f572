#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {
namespace {

// What drag costs a straight drive depends on how the treads give way: as the simulated ones do, or
// the same on every run, whatever its length.  So straight and turning drives have a strength each.
std::vector<Signature> rolling_signatures(const Study& study, ProbedSlopes slopes) {
  const std::vector<Eigen::Vector3d>& slope = slopes[0];
  std::vector<Eigen::Vector3d> along = slope, turning = slope, per_run = slope;
  for (std::size_t i = 0; i < study.size(); ++i) {
    (is_straight(study, i) ? turning : along)[i].setZero();
    per_run[i].setZero();
    if (is_straight(study, i)) per_run[i].x() = study.cells[study.trials[i].cell].mirror;
  }
  std::vector<Signature> all;
  for (const auto* other : {&along, &per_run}) {
    Signature s;
    s.effect = "rolling_resistance";
    s.columns = stack({study.whiten(turning), study.whiten(*other)});
    s.parameters = {"rolling_resistance.coefficient"};
    s.penalty = 1;
    all.push_back(std::move(s));
  }
  return all;
}

}  // namespace

extern const EffectDiagnosis kRollingResistance = {
    .effect = "rolling_resistance",
    .steps = {{"coefficient", 0.05, false}},
    .signatures = rolling_signatures,
    .changes_reach = true,
    .by_contact = true,
    .family = &kReachFamily,
    .aliases = {"motor_deadband"},
    .model_error = 0.3,
    .phrases = {"Rolling drags with %1 of the weight",
                {{"coefficient", 100, " %"}},
                "Give the simulation that drag"},
};

}  // namespace gapfarm
