#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "common/parameters/push.h"
#include "master/diagnose/drive_designs.h"
#include "master/diagnose/estimate.h"
#include "master/diagnose/findings.h"
#include "master/diagnose/nuisance.h"
#include "master/diagnose/patch_sketch.h"
#include "master/diagnose/push/push_subject.h"
#include "master/diagnose/subject.h"
#include "master/diagnose/where.h"

namespace gapfarm {
namespace {

PatchSearch sketched_patches(Predictor& predictor, const Study& study) {
  const auto sketch = std::make_shared<const PatchSketch>(predictor.problem(), study);
  return [sketch](const Regression& explained, std::size_t most,
                  double least) -> Result<std::vector<Patch>> {
    std::vector<Patch> patches;
    for (const PatchSketch::Place& place : sketch->search(explained, most, least)) {
      patches.push_back(place.patch);
    }
    return patches;
  };
}

// A tracked robot drives commands.
DiagnosisSubject srv1_subject() {
  DiagnosisSubject s;
  s.scenario = "srv1";
  s.looks = kLooksForLateReadings | kLooksForLag | kLooksForSlips | kLooksForRounding;
  // The best of the catalogue gained 4.4 at most in 90 of 100 null logs, 6.7 in 99, and the least
  // p of twelve blocks was 10^-3.8 (400 logs; docs/diagnosis.md).
  s.least_gain = 9;
  s.unknown_log10_p = -4.2;
  s.farthest = 0;  // slips are looked for
  s.noise_tail = 1;
  s.base_moves = false;
  s.drive_common = {row_of(Srv1::kDriveNoiseCommon)};
  s.drive_side = {row_of(Srv1::kDriveNoiseSide)};
  s.pose_position = {row_of(Srv1::kPoseNoisePosition)};
  s.pose_heading = {row_of(Srv1::kPoseNoiseHeading)};
  s.drive_tail = {row_of(Srv1::kDriveNoiseTail)};
  s.pose_tail = {row_of(Srv1::kPoseNoiseTail)};
  s.speed = row_of(Srv1::kFullSpeed);
  s.covariance = trial_covariance;
  s.make_study = [](const Problem& problem, std::span<const Gene>) { return make_study(problem); };
  s.tune = tune_base;
  s.nuisances = [](Predictor& predictor, Study& study) {
    return nuisance_columns(predictor, study);
  };
  s.blocks = covariate_blocks;
  s.signatures = signatures;
  s.in_reach = [](const ResidualTrial& trial, const Patch& patch) {
    return std::hypot(trial.X_WS.x - patch[0], trial.X_WS.y - patch[1]) < patch[2] + 0.5;
  };
  s.patches = sketched_patches;
  s.folds = folds_of;
  s.where = [](const Study& study, std::span<const Eigen::Vector3d> residuals,
               const Problem& problem) {
    return where(study.trials, residuals, study.covariances(), study.cells, problem);
  };
  s.cautions = [](const Study& study, const TrialLog& log) {
    return cautions(study.trials, study.cells, log);
  };
  s.lacks = [](const Study& study, const TrialLog& log) {
    return lacking(log_variety(study.trials, study.cells, log));
  };
  s.experiments = plan_drives;
  s.effect_words = nullptr;
  s.view = [](const Study& study, std::size_t trial) {
    return TrialView{study.trials[trial].X_WS, 0, {}};
  };
  return s;
}

}  // namespace

const DiagnosisSubject* diagnosis_subject(std::string_view scenario) {
  static const std::array<DiagnosisSubject, 2> subjects = {srv1_subject(), push_subject()};
  const auto found = std::find_if(subjects.begin(), subjects.end(), [&](const DiagnosisSubject& s) {
    return scenario == s.scenario;
  });
  return found == subjects.end() ? nullptr : &*found;
}

}  // namespace gapfarm
