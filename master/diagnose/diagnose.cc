#include "master/diagnose/diagnose.h"

#include <algorithm>
#include <cmath>

#include "common/base/suggest.h"
#include "master/diagnose/diagnose_steps.h"

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
  if (diagnosis_subject(problem.scenario) == nullptr) {
    return Error{"scenario " + problem.scenario +
                 " cannot be diagnosed: it has no catalogue of effects; `gapfarm influence` says "
                 "what its parameters do"};
  }
  if (Status s = check_left_out(problem, options.left_out); !s) return s.error();
  DiagnosisRun run(farm, problem, options);
  run.stage("tune the base model");
  if (Status s = run.tune(); !s) return s.error();
  run.stage("measure the noise");
  if (Status s = run.measure_noise(); !s) return s.error();
  run.stage("screen the catalogue");
  if (Status s = run.screen(); !s) return s.error();
  run.stage("judge what is left");
  run.judge();
  run.stage("refit base and effects together");
  if (Status s = run.refit(); !s) return s.error();
  run.stage("say where, how far and what next");
  if (Status s = run.report(); !s) return s.error();
  run.stage("");
  return run.take();
}

}  // namespace gapfarm
