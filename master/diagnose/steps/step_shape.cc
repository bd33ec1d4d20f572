// The shape of what nobody can name: a smooth correction of what the last model leaves.

#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/statistics.h"
#include "common/score/motion_model.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/conclusions/report_parts.h"
#include "master/diagnose/correction/fit.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/infer/compete.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

// Sessions, joined where there are many and cut into blocks where there are few.
std::vector<std::size_t> residual_folds(const Study& study) {
  const std::size_t sessions = std::max<std::size_t>(study.sessions, 1);
  const std::size_t blocks = (kFolds + sessions - 1) / sessions;
  std::vector<std::size_t> counts(sessions, 0), seen(sessions, 0), folds;
  for (const ResidualTrial& t : study.trials) ++counts[t.session];
  for (const ResidualTrial& t : study.trials) {
    const std::size_t block = seen[t.session]++ * blocks / counts[t.session];
    folds.push_back(t.session * blocks + block);
  }
  const std::size_t count = sessions * blocks;
  for (std::size_t& f : folds) f = count > kMostFolds ? f * kMostFolds / count : f;
  return folds;
}

std::string percent_text(double share) { return plain_number(std::round(100 * share)) + " %"; }

// "each command's shift by duration and greater duty, in the robot's axes"
std::string term_text(const ResidualTerm& term) {
  std::vector<std::string> labels = mapped(term.covariates, [](const std::size_t row) {
    return std::string(residual_covariates()[row].label);
  });
  const std::string by = listed(labels);
  if (term.frame == ResidualFrame::kReadings) return "a shift of every reading by its " + by;
  if (term.frame == ResidualFrame::kMotion) return "shares of the motion by " + by;
  const std::string whose = term.weights.size() > 1 ? "each command's shift" : "a shift";
  return whose + " by " + by +
         (term.frame == ResidualFrame::kRobot ? ", in the robot's axes" : ", in the world's axes");
}

// Places count from the world's origin where they did from `origin`.
ResidualField in_world(ResidualField field, const Eigen::Vector2d& origin) {
  for (ResidualTerm& term : field) {
    for (std::size_t j = 0; j < term.covariates.size(); ++j) {
      const std::string_view name = residual_covariates()[term.covariates[j]].name;
      if (name == "x") term.centres.col(j).array() += origin.x();
      if (name == "y") term.centres.col(j).array() += origin.y();
    }
  }
  return field;
}

std::string residual_sentence(const FoundResidual& found) {
  if (found.correction.empty()) {
    return "Corrections of what is left were tried, smooth ones and of single outlier drives; none "
           "helps significantly on trials that no fit saw, so none is kept.";
  }
  std::vector<std::string> terms = mapped(found.correction.field, term_text);
  if (found.correction.outliers) terms.push_back(outlier_text(*found.correction.outliers));
  return "A correction without a cause closes " + percent_text(found.closed) + " [" +
         percent_text(found.closed_lo) + ", " + percent_text(found.closed_hi) +
         "] of the gap on trials that its fit did not see: " + joined(terms, "; ") +
         ". model.toml has it as [residual].";
}

// A correction beside the last of the nested fits, with scores on trials that neither saw.
struct TriedShape {
  Residual residual;  // empty: none helps
  std::vector<double> without_it, with_it;
  NoiseEstimate noise;  // of predictions beside it
  // What the smooth part leaves, and of that what may lie far off.
  Study beside;
  OutlierLesson lesson;
  std::vector<double> chances;  // of every trial to be an outlier
};

void predict_beside(const DiagnosisRequest& of, const Refit& refit, const Residuals& after,
                    Study* beside, TriedShape* tried) {
  const Explanation& named = refit.judged.named;
  const double share = of.outlier_share();
  if (!named.names_outliers()) {
    estimate_noise(Regression(named.evidence->nuisances, beside->whitened_residuals()),
                   named.evidence->blocks, beside);
  }
  if (beside->predictive) {
    beside->predictive =
        fit_predictive_noise(beside->trials, after, beside->noise, of.subject, share, true).noise;
  }
  tried->with_it = scores_of(*beside, after, share);
  tried->noise = beside->predictive_noise();
}

// The smooth part's ends and what they leave; outliers are looked for about them.
OutlierLesson lesson_about(const ResidualData& data, const Study& study, const Residuals& seen,
                           const ResidualFit& smooth, const Residuals& unseen) {
  OutlierLesson lesson{data.ends, seen, unseen, data.fold, data.learn};
  for (std::size_t i = 0; i < data.size(); ++i) {
    const ResidualTrial& t = study.trials[i];
    const Pose& end = lesson.ends[i] = corrected_end(smooth.field, data.facts[i], data.ends[i]);
    lesson.residuals[i] = local_difference(end, end_with(t, data.ends[i], seen[i]));
    lesson.unseen[i] = local_difference(end, end_with(t, end, unseen[i]));
  }
  return lesson;
}

TriedShape try_shape(const DiagnosisRequest& of, const Refit& refit) {
  const JointFit& last = refit.nested.back().fit;
  const JointFit& reported_fit = refit.final_fit ? *refit.final_fit : last;
  const Study& study = refit.nested.back().study;
  const std::vector<std::size_t> folds = residual_folds(study);
  ResidualData data{logged_motions(of.problem),
                    reported_fit.ends,
                    study.whitener,
                    folds,
                    std::vector<bool>(study.size(), true),
                    study.free_commands};
  for (std::size_t i = 0; i < study.size(); ++i) data.learn[i] = !study.ignores(i);
  const ResidualFit fit = fit_residual(data, reported_fit.residuals, [&](std::size_t fold) {
    return left_without(study, last, folds, fold);
  });
  TriedShape tried;
  tried.residual.field = fit.field;
  const double share = of.outlier_share();
  const std::vector<Eigen::Vector3d> before = held_out_residuals(study, last, folds);
  std::vector<Eigen::Vector3d> after = before;
  Study beside = study;
  for (std::size_t i = 0; i < study.size(); ++i) after[i] -= fit.unseen[i];
  beside.use_residuals(after);
  tried.without_it = tried.with_it = scores_of(study, before, share);
  if (!fit.field.empty()) predict_beside(of, refit, after, &beside, &tried);
  tried.lesson = lesson_about(data, study, reported_fit.residuals, fit, after);
  tried.beside = std::move(beside);
  return tried;
}

TriedShape with_outliers(const DiagnosisRequest& of, const Refit& refit, TriedShape tried) {
  if (refit.judged.named.names_outliers()) return tried;
  auto found_outliers = look_for_outliers(of, tried.beside, tried.lesson);
  if (!found_outliers || !clearly_better(found_outliers->scores, tried.with_it)) return tried;
  tried.residual.outliers = found_outliers->outliers;
  tried.with_it = std::move(found_outliers->scores);
  tried.noise = found_outliers->noise;
  tried.chances = std::move(found_outliers->chances);
  return tried;
}

}  // namespace

Refit add_shape(const DiagnosisRequest& of, const Refit& refit) {
  Refit with = refit;
  const Verdict verdict = refit.judged.verdict;
  const bool unexplained = verdict == Verdict::kUnknown || verdict == Verdict::kEffectAndUnknown;
  // A lag found in paths is in the model that is written, but not in these fits.
  const bool possible = scenario_form(of.problem.scenario).residual &&
                        refit.judged.named.spread("motor_lag") == nullptr;
  if (!unexplained || !possible) return with;
  FoundResidual& found = with.shape.emplace();
  found.text = residual_sentence(found);
  const TriedShape tried = with_outliers(of, refit, try_shape(of, refit));
  if (tried.residual.empty() || !clearly_better(tried.with_it, refit.nested.back().scores))
    return with;
  const auto n = static_cast<double>(tried.with_it.size());
  const std::vector<double> gains = gains_over(tried.with_it, tried.without_it);
  const auto [sum, se] = infer::paired_gain(tried.with_it, tried.without_it);
  const double gained = sum / n, half = kNormal90 * se / n;
  // The noise that passed for the floor had the outliers in it.
  if (tried.residual.outliers) with.floor = std::max(refit.floor, mean(tried.with_it));
  const ClosedShare closed = closed_share(of, with, gains);
  if (!(gained - half > 0 && closed.lo > 0)) {
    with.floor = refit.floor;
    return with;
  }
  found = {{in_world(tried.residual.field, of.frame_m), tried.residual.outliers},
           gained,
           gained - half,
           gained + half,
           with.floor - mean(tried.without_it),
           std::max(0.0, with.floor - mean(tried.with_it)),
           std::min(1.0, closed.share),
           std::min(1.0, closed.lo),
           std::min(1.0, closed.hi),
           "",
           tried.chances};
  found.text = residual_sentence(found);
  with.residual = tried.residual;
  with.noise = tried.noise;
  return with;
}

}  // namespace gapfarm::steps
