// What a diagnosis has to know of a scenario, as a row of a table.
//
// Most of the rest is linear algebra over three whitened rows a trial, whatever moves; stages that
// look for a named effect (a lag, late poses, slips, a seam) ask whether the scenario has it.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/conclusions/next_experiment.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/evidence/covariates.h"
#include "master/diagnose/fit/signatures.h"
#include "master/diagnose/places/patch.h"
#include "master/diagnose/result/diagnosis.h"
#include "master/diagnose/study.h"

namespace gapfarm {

// Where a value of NoiseEstimate stands in the parameter table, and its unit there.
struct NoiseRow {
  std::size_t row = 0;
  double unit = 1;
};

struct TrialView {
  Pose X_WV;            // ends are seen from here
  double turn_rad = 0;  // residuals are reported in the predicted end's axes turned by this
  std::vector<double> covariates;  // one a DiagnosisSubject::shown
};

struct DiagnosisSubject {
  const char* scenario = nullptr;
  const EffectDiagnoses* effects = nullptr;
  // Net log-likelihood (nats over all trials) that an effect must gain to be named.
  double least_gain;
  // Standard deviations beyond which a trial that nothing smooth explains counts no more; 0: none.
  double farthest;
  // Steps a second that do for a fit's derivatives; 0: the problem's own.  Its residuals are always
  // the problem's own.
  double slope_rate_hz = 0;
  // Headings that do for them, where that rate is coarser than the problem's; 0: as many as it
  // takes.
  std::uint32_t slope_headings = 0;
  // Whether strong effects are fitted with the base beside them, and looked for again from the base
  // and the noise that they leave: where the base was tuned without them, both may be far off.
  bool base_moves;
  NoiseRow drive_common, drive_side, pose_position, pose_heading;
  std::optional<NoiseRow> drive_tail, pose_tail;  // both or none; the readings then vary a trial by
                                                  // reading_covariance()
  CovarianceOf covariance;

  // Errors: an empty log.  `genes`: what the config has searched.
  Result<Study> (*make_study)(const Problem& problem, std::span<const Gene> genes);
  // Tunes the base, or keeps that of the problem, and fills in what depends on it.
  Status (*tune)(Predictor& predictor, bool keep, Study* study);
  // Whitened columns, scaled to a prior standard deviation of 1, of what no effect may claim.
  Result<Eigen::MatrixXd> (*nuisances)(Predictor& predictor, Study& study);
  std::vector<CovariateBlock> (*blocks)(const Study& study);
  // Null where base and hypotheses are searched together instead: EffectDiagnosis::searched.
  Result<std::vector<Signature>> (*signatures)(Predictor& predictor, const Study& study,
                                               const std::vector<std::string>& excluded) = nullptr;
  // Trials in which the robot touches the disc, with the study's base; null as above, as is
  // `patches`.
  std::vector<std::uint32_t> (*touched_by)(const Problem& problem, const Study& study,
                                           const Patch& patch) = nullptr;
  PatchSearch (*patches)(Predictor& predictor, const Study& study) = nullptr;
  // The parts of the log that are predicted from the others, one number a trial.
  std::vector<std::size_t> (*folds)(const Study& study);

  std::vector<Where> (*where)(const Study& study, std::span<const Eigen::Vector3d> residuals,
                              const Problem& problem);
  std::vector<std::string> (*cautions)(const Study& study, const TrialLog& log);
  // What the log would need to part effects that look alike in it.
  std::vector<std::string> (*lacks)(const Study& study, const TrialLog& log);
  // Trials that might part competing explanations; null as above.
  ExperimentPlan (*experiments)(const Problem& problem) = nullptr;
  TrialView (*view)(const Study& study, std::size_t trial);
  std::vector<ShownCovariate> shown;  // in the pictures, beside what every log has
  PictureLabels labels;
};

// Null where the problem's scenario cannot be diagnosed.
std::shared_ptr<const DiagnosisSubject> diagnosis_subject(const Problem& problem);

// Each command for 0.5, 1 and 2 s at half and full level: from several headings and places within
// the log's own, straight after driving the opposite way, and late in a session.
ExperimentPlan plan_drives(const Problem& problem);

}  // namespace gapfarm
