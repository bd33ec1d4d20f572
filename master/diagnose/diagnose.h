// The diagnosis: where the gap lies, which effect causes it, how far it shrinks
// (docs/diagnosis.md).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/problem/problem.h"
#include "master/diagnose/diagnosis.h"
#include "master/diagnose/predictor.h"
#include "master/farm/farm.h"

namespace gapfarm {

struct DiagnoseOptions {
  bool keep_base = false;             // the problem's values are a tuned model
  std::vector<std::string> left_out;  // effects that the catalogue is to be without
  std::uint64_t seed = 1;             // of the bootstrap
  std::vector<Gene> genes;            // what the config has searched: what may be tuned of the base
  std::function<void(const std::string& stage)> on_stage;
};

struct DiagnosisResult {
  Diagnosis diagnosis;
  ParameterValues tuned;   // the base model, as tuned
  ParameterValues final_;  // with the named effects
  // 90 % intervals of `final_`; lo > hi where there is none.
  std::vector<std::pair<double, double>> intervals;
  // The fits behind the gaps ("the tuned base", "the tuned base, floor_tilt", ...) and the farm's
  // tasks that predicted them.
  std::vector<std::pair<std::string, std::vector<v1::Task>>> fits;
};

// Errors: a scenario that cannot be diagnosed, an empty log, an effect to leave out that the
// catalogue does not have, the farm's.
Result<DiagnosisResult> diagnose(Farm& farm, const Problem& problem,
                                 const DiagnoseOptions& options);

}  // namespace gapfarm
