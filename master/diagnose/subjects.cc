#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "common/parameters/push.h"
#include "common/pose/segment.h"
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
  return
      [sketch](const Regression& explained, const PatchWish& wish) -> Result<std::vector<Patch>> {
        std::vector<Patch> patches;
        for (const PatchSketch::Place& place : sketch->search(explained, wish)) {
          patches.push_back(place.patch);
        }
        return patches;
      };
}

// Whether a robot's contacts may come over the disc: on its way from the logged start to the end
// that is predicted without it, which bows out no farther than an ellipse through both.
bool drives_over(const Study& study, const ResidualTrial& trial, const Patch& patch) {
  // Half the diagonal of the largest robot of the SRV-1's table.
  constexpr double kContacts_m = 0.11, kSpare_m = 0.03, kSpareWay = 1.1;
  const CommandSpec& command = study.cells[trial.cell].command;
  const Eigen::Vector2d from(trial.X_WS.x, trial.X_WS.y), to(trial.X_WP.x, trial.X_WP.y);
  const double way =
      kSpareWay * std::abs(command.left + command.right) / 2 * command.duration_s * study.speed_m_s;
  const double bow = std::sqrt(std::max(0.0, way * way - (to - from).squaredNorm())) / 2;
  return nearest_on_segment({patch[0], patch[1]}, from, to).distance <
         patch[2] + bow + kContacts_m * study.scale + kSpare_m * study.scale;
}

// A robot on two sides drives commands: srv1's, or one that a program of the user's simulates.
DiagnosisSubject drive_subject(const char* scenario, const ParameterTable& table) {
  DiagnosisSubject s;
  s.scenario = scenario;
  s.effects = &drive_effect_diagnoses();
  s.looks = kLooksForLateReadings | kLooksForLag | kLooksForSlips | kLooksForRounding;
  // The best of the catalogue gained 4.4 at most in 90 of 100 null logs, 6.7 in 99, and the least
  // p of twelve blocks was 10^-3.8 (400 logs; docs/diagnosis.md).
  s.least_gain = 9;
  s.unknown_log10_p = -4.2;
  s.farthest = 0;  // slips are looked for
  s.noise_tail = 1;
  s.base_moves = false;
  s.drive_common = {table.row("drive_noise_common")};
  s.drive_side = {table.row("drive_noise_side")};
  s.pose_position = {table.row("pose_noise_position")};
  s.pose_heading = {table.row("pose_noise_heading")};
  s.drive_tail = {table.row("drive_noise_tail")};
  s.pose_tail = {table.row("pose_noise_tail")};
  s.covariance = trial_covariance;
  s.make_study = make_study;
  s.tune = tune_base;
  s.nuisances = [](Predictor& predictor, Study& study) {
    return nuisance_columns(predictor, study);
  };
  s.blocks = covariate_blocks;
  s.signatures = signatures;
  s.in_reach = drives_over;
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
  s.view = [](const Study& study, std::size_t trial) {
    return TrialView{study.trials[trial].X_WS, 0, {}};
  };
  return s;
}

DiagnosisSubject srv1_subject() {
  DiagnosisSubject s = drive_subject("srv1", srv1_table());
  s.slope_rate_hz = 60;
  s.slope_headings = 6;
  return s;
}

}  // namespace

std::shared_ptr<const DiagnosisSubject> diagnosis_subject(const Problem& problem) {
  // A program has rows of its own, so its subject is its problem's.
  if (problem.external) {
    return std::make_shared<const DiagnosisSubject>(drive_subject("external", problem.table()));
  }
  static const std::array<std::shared_ptr<const DiagnosisSubject>, 2> subjects = {
      std::make_shared<const DiagnosisSubject>(srv1_subject()),
      std::make_shared<const DiagnosisSubject>(push_subject())};
  const auto found = std::find_if(subjects.begin(), subjects.end(), [&](const auto& subject) {
    return problem.scenario == subject->scenario;
  });
  return found == subjects.end() ? nullptr : *found;
}

}  // namespace gapfarm
