#include "master/diagnose/diagnose.h"

#include <algorithm>
#include <cmath>

#include "common/base/suggest.h"
#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/prepare.h"

namespace gapfarm {
namespace {

Status check_left_out(const Problem& problem, const std::vector<std::string>& left_out) {
  std::vector<std::string> known;
  for (const Effect& effect : problem.table().effects()) known.push_back(effect.name);
  for (const std::string& name : left_out) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      return Error{"there is no effect '" + name + "' to leave out" + suggestion(name, known)};
    }
  }
  return {};
}

}  // namespace

// The steps in the order of docs/diagnosis.md.
Result<DiagnosisResult> diagnose(Farm& farm, const Problem& problem,
                                 const DiagnoseOptions& options) {
  if (diagnosis_subject(problem) == nullptr) {
    return Error{"scenario " + problem.scenario +
                 " cannot be diagnosed: it has no catalogue of effects; `gapfarm influence` says "
                 "what its parameters do"};
  }
  if (Status s = check_left_out(problem, options.left_out); !s) return s.error();
  const PreparedLog log = prepare_log(problem, options.frame_m);
  if (any_unusable(log.sanity)) return unusable_result(log);
  DiagnosisRun run(farm, log, options);
  const std::array<std::function<Status()>, kDiagnosisStages.size()> steps = {
      [&] { return run.tune(); },   [&] { return run.measure_noise(); },
      [&] { return run.screen(); }, [&] { return run.judge(); },
      [&] { return run.refit(); },  [&] { return run.report(); }};
  for (std::size_t k = 0; k < steps.size(); ++k) {
    run.stage(kDiagnosisStages[k].name);
    const Status s = steps[k]();
    if (s) {
      run.tell_of_stage(k);
      continue;
    }
    if (s.error().code != ErrorCode::kSimulation) return s.error();
    run.stage("");
    return run.give_up(kDiagnosisStages[k].name, s.error());
  }
  run.stage("");
  return run.take();
}

}  // namespace gapfarm
