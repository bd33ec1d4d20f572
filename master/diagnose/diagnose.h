// The diagnosis: where the gap lies, which effect causes it, how far it shrinks
// (docs/diagnosis.md).
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "common/progress/overall_progress.h"
#include "master/diagnose/result/diagnosis.h"
#include "master/farm/farm.h"
#include "master/infer/predictor.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {

// The stages of a diagnosis in their order, and the share of its time that each usually takes (the
// median of 77 logs of 600 drives).
struct DiagnosisStage {
  const char* name;
  double share;
};
inline constexpr std::array<DiagnosisStage, 6> kDiagnosisStages = {
    {{"tune the base model", 0.1},
     {"measure the noise", 0.06},
     {"screen the catalogue", 0.6},
     {"judge what is left", 0.01},
     {"refit base and effects together", 0.2},
     {"report where, how far and what next", 0.03}}};

struct DiagnoseOptions {
  bool keep_base = false;             // the problem's values are a tuned model
  std::vector<std::string> excluded;  // effects that the catalogue is to be without
  std::uint64_t seed = 1;             // of the bootstrap
  // World position that the values' places count from, where the problem's values have such places;
  // else it is chosen by the log.
  std::optional<Eigen::Vector2d> frame_m;
  std::vector<Gene> genes;  // what the config has searched: what may be tuned of the base
  std::function<void(const std::string& stage)> on_stage;
  OnFinding on_finding;  // of the present stage, for who watches; nothing depends on it
};

struct DiagnosisResult {
  Diagnosis diagnosis;
  std::string problem;  // hash of what was simulated: the log in its own frame
  // World position that the values' places count from.
  Eigen::Vector2d frame_m = Eigen::Vector2d::Zero();
  ParameterValues tuned;   // the base model, as tuned
  ParameterValues final_;  // with the named effects
  Residual residual;       // beside final_: what they leave unexplained; may be empty
  // 90 % intervals of `final_`; lo > hi where there is none.
  std::vector<std::pair<double, double>> intervals;
  // The fits behind the gaps ("the tuned base", "the tuned base, floor_tilt", ...) and the farm's
  // tasks that predicted them.
  std::vector<std::pair<std::string, std::vector<v1::Task>>> fits;
};

// An error where the problem's catalogue has no such effect to omit.
Status check_excluded(const Problem& problem, const std::vector<std::string>& excluded);

// A log that cannot be used is reported without any simulation (verdict "unusable"), and what
// cannot be simulated is excluded and reported.  Errors: a scenario that cannot be diagnosed, an
// empty log, an effect to omit that the catalogue does not have, the farm's.
Result<DiagnosisResult> diagnose(Farm& farm, const Problem& problem,
                                 const DiagnoseOptions& options);

// A log and config in the log's own frame, without rows that cannot be.
struct PreparedLog {
  Problem problem;
  // World position of that frame's origin, whole metres: (0, 0) for a log near the world's origin,
  // else its middle, so that places stay within the parameters' bounds wherever a map begins.
  Eigen::Vector2d frame_m = Eigen::Vector2d::Zero();
  std::vector<SanityFinding> sanity;
};
// `frame_m`: what it has to be, where that is known.
PreparedLog prepare_log(const Problem& problem,
                        const std::optional<Eigen::Vector2d>& frame_m = std::nullopt);

DiagnosisResult unusable_result(const PreparedLog& log);

}  // namespace gapfarm
