#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "common/parameters/push.h"
#include "common/pose/pose.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/drive_designs.h"
#include "master/diagnose/fit/estimate.h"
#include "master/diagnose/fit/free_commands.h"
#include "master/diagnose/fit/nuisance.h"
#include "master/diagnose/places/footprint.h"
#include "master/diagnose/places/patch_sketch.h"
#include "master/diagnose/places/where.h"
#include "master/diagnose/push/push_subject.h"
#include "master/diagnose/subject.h"

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

// How near the robot's contacts come to a disc's centre, on the way that the base predicts.
double nearest_to(const Patch& patch, const Pose& X_WS, const Twist& motion,
                  const Footprint& footprint) {
  constexpr int kLooks = 16;
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= kLooks; ++k) {
    const Pose X_WB = X_WS * exp(Twist(motion * k / kLooks));
    for (const Eigen::Vector2d& contact : footprint.contacts()) {
      const Pose at = X_WB * Pose{contact.x(), contact.y(), 0};
      nearest = std::min(nearest, std::hypot(at.x - patch[0], at.y - patch[1]));
    }
  }
  return nearest;
}

std::vector<bool> touched_by_drives(const Problem& problem, const Study& study,
                                    const Patch& patch) {
  constexpr double kSpare_m = 0.03;  // for a way that is none of one twist, and between its steps
  const double spare = kSpare_m * study.scale;
  const Footprint footprint = footprint_of(problem, study);
  std::vector<bool> touched;
  for (std::size_t i = 0; i < study.size(); ++i) {
    touched.push_back(nearest_to(patch, study.trials[i].X_WS, motion_of(study, i), footprint) <
                      patch[2] + spare);
  }
  return touched;
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
  s.touched_by = touched_by_drives;
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
  if (problem.external && !problem.windows()) {
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
