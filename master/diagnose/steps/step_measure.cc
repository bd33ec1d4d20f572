// The base, the noise and the evidence that later steps look at.

#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/evidence/session_gains.h"
#include "master/diagnose/steps/step_parts.h"

namespace gapfarm::steps {

Result<Study> tune(const DiagnosisRequest& of) {
  Result<Study> study = of.subject.make_study(of.problem, of.options.genes);
  if (!study) return study;
  const Status tuned = of.subject.tune(of.predictor, of.options.keep_base, &*study);
  if (!tuned) return tuned.error();
  return study;
}

Result<Evidence> evidence_of(const DiagnosisRequest& of, Study study) {
  auto nuisances = of.subject.nuisances(of.predictor, study);
  if (!nuisances) return nuisances.error();
  if (study.session_spread > 0) *nuisances = beside_sessions(study, *nuisances);
  std::vector<CovariateBlock> blocks = of.subject.blocks(study);
  Regression base(*nuisances, study.whitened_residuals());
  return Evidence{std::move(study), std::move(*nuisances), std::move(blocks), std::move(base)};
}

Eigen::MatrixXd beside_sessions(const Study& study, const Eigen::MatrixXd& nuisances) {
  const Eigen::MatrixXd own = session_columns(study, study.session_spread);
  Eigen::MatrixXd both(own.rows(), own.cols() + nuisances.cols());
  both << own, nuisances;
  return both;
}

Result<Evidence> measure(const DiagnosisRequest& of, const Study& tuned) {
  auto evidence = evidence_of(of, tuned);
  // Twice where far trials are trusted less: again without what they drew to themselves.
  for (int round = 0; round < 2 && evidence; ++round) {
    if (round > 0 && evidence->study.trust.empty()) break;
    Study measured = evidence->study;
    estimate_noise(evidence->base, evidence->blocks, &measured);
    evidence = evidence_of(of, std::move(measured));
  }
  return evidence;
}

Explanation without(const Explanation& all, const std::vector<bool>& ignored) {
  Explanation rest = all;
  Study study = all.study();
  study.ignored = ignored;
  Eigen::VectorXd residuals = study.whitened_residuals();
  study.drop_ignored(residuals);
  Eigen::MatrixXd nuisances = all.evidence->nuisances;
  study.drop_ignored(nuisances);
  std::vector<CovariateBlock> blocks = all.evidence->blocks;
  for (CovariateBlock& block : blocks) study.drop_ignored(block.columns);
  for (Signature& s : rest.first) study.drop_ignored(s.columns);
  Regression base(nuisances, residuals);
  rest.evidence = std::make_shared<const Evidence>(
      Evidence{std::move(study), std::move(nuisances), std::move(blocks), std::move(base)});
  return rest;
}

}  // namespace gapfarm::steps
