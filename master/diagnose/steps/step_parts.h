// What several steps of a diagnosis are made of.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "master/diagnose/correction/outlier_fit.h"
#include "master/diagnose/steps/steps.h"

namespace gapfarm::steps {

// Hypotheses compete, beside what is explained already; what was chosen before is chosen anew.
Result<Screening> compete(const DiagnosisRequest& of, Explanation found);
// The catalogue's marks at the base of the evidence; REQUIRES: the scenario has them.
Result<std::unique_ptr<Proposals>> marks_of(const DiagnosisRequest& of, const Explanation& found);
// What each effect would explain before any is chosen: rows of the screening table.
Status screen_alone(const DiagnosisRequest& of, const Explanation& found, Screening* screening);
// The effects at their joint estimate, each one's contribution beside its slopes; no columns where
// that cannot be simulated.
struct Relinearised {
  Eigen::VectorXd data;                  // whitened, as if the predictions were linear
  std::vector<Eigen::MatrixXd> columns;  // one matrix an effect
};
Result<Relinearised> relinearised_at(const DiagnosisRequest& of, const Study& study,
                                     const JointFit& fit,
                                     const std::vector<EffectCandidate>& effects);

// Score by score.
std::vector<double> gains_over(std::vector<double> scores, const std::vector<double>& others);
// "rate 0.0035 1/min": a row of an effect, a place as the world has it.
std::string value_text(const DiagnosisRequest& of, std::size_t row, double value,
                       const Overrides& at);
// By paired scores: not by chance, but for one case in twenty.
bool clearly_better(const std::vector<double>& scores, const std::vector<double>& others);

// What tuning moves, and what else of the base the config has searched, within its prior.
std::vector<BaseParameter> whole_base(const DiagnosisRequest& of, const Study& study);

// A study beside these, without what ignored trials say.
Evidence evidence_beside(Study study, Eigen::MatrixXd nuisances,
                         std::vector<CovariateBlock> blocks);
// The study's nuisances and covariates by its present noise.
Result<Evidence> evidence_of(const DiagnosisRequest& of, Study study);
// The same beside nuisances as they are there; none where that cannot be simulated.
Result<std::optional<Evidence>> evidence_at(const DiagnosisRequest& of, const Evidence& before,
                                            const Overrides& at);
// Nuisances, and before them what the gains of the study's sessions do.
Eigen::MatrixXd beside_sessions(const Study& study, const Eigen::MatrixXd& nuisances);
// The same without what these trials say.
Explanation without(const Explanation& all, const std::vector<bool>& ignored);

Result<Explanation> look_for_late_readings(const DiagnosisRequest& of, Explanation partial);
// Where paths were logged they say more of a lag than rest poses do, and have the last word.
Result<Explanation> look_for_lag(const DiagnosisRequest& of, Explanation partial);
// The likeliest effect that makes single trials outliers; those that are predicted better once it
// is foreseen show nothing of means.  Before any effect on the mean, for outlier trials would pass
// for a patch of floor or a seam; `by_means`: beside what effects explain of the means (nats).
Explanation look_for_spreads(const DiagnosisRequest& of, Explanation partial,
                             const Regression& explained,
                             std::optional<double> by_means = std::nullopt);
// Without a trial that is like no other beside what is explained, which no effect foresees.
Result<Explanation> leave_lone_out(const DiagnosisRequest& of, Explanation partial,
                                   const Regression& explained);
// Whether each session has a gain of its own, of a spread that is clear from what is left of every
// trial (m, m, rad); no statement about means uses them then.
Explanation look_for_session_gains(const DiagnosisRequest& of, Explanation partial,
                                   const std::vector<Eigen::Vector3d>& left);
// What is left once all that was chosen is explained, and the nats that it took.
Regression explained_by(const Proposals& catalogue, const Explanation& explanation);
double explained_nats(const Proposals& catalogue, const Regression& explained);

double sum_of_gains(const std::vector<EffectCandidate>& chosen);
// What is left beside what is explained, also what repeats of a trial have in common.
std::vector<Leftover> all_leftovers(const Explanation& explanation, const Regression& explained);
// What the remaining effects leave at their estimates, where some were dropped.
Judgement judge_again(const Proposals& catalogue, Judgement judged);

// Nothing is named any more; readings are as logged.
Explanation naming_nothing(Explanation explanation);
// Why nothing is to be named where tuning ended on the edge of what the scenario can be.
SanityFinding on_bounds(const DiagnosisRequest& of, const Study& tuned);
// What is named explains not the whole where it leaves more than it closes, and more than sound
// logs keep.
Judgement beside_the_rest(const Refit& refit);
// With its effects the model should predict about as well as its noise allows: why not to name any.
std::optional<SanityFinding> missing_too_much(const Refit& refit);
Judgement with_warning(Judgement judged, SanityFinding finding);
// As if nothing had been looked for.
Judgement with_base_warning(const DiagnosisRequest& of, const Evidence& measured, Judgement judged);

struct Worthless {
  std::size_t effect = 0;
  std::string why;
};
// Trials that no fit saw are predicted no better with it than with what comes before it alone.
// `perfect`: what a prediction scores that misses nothing, once that is known.
std::optional<Worthless> of_no_use(const Judgement& judged, const std::vector<NestedFit>& nested,
                                   std::optional<double> perfect);
Judgement dropped(Judgement judged, const Worthless& effect);
// Why an effect of these values is no cause: its best size is more than there can be, or the middle
// of a lens lies where it does no more than a sheared picture does.
std::optional<std::string> at_its_bound(const DiagnosisRequest& of, const std::string& effect,
                                        const Overrides& at);

// An effect that shifts single trials, such as a patch, passed for noise where it is not smooth:
// what the fit leaves is measured as the tuned base's noise was.  Slips' noise came with them.
Study study_beside(const Explanation& named, const JointFit& fit);
// Of every trial, by the fits to the other folds.
void score(const DiagnosisRequest& of, const std::vector<std::size_t>& folds, NestedFit* nested);
// What a perfect prediction would score, with what makes single trials outliers foreseen; what does
// not help with that is dropped.
Refit with_floor(const DiagnosisRequest& of, Refit refit, const std::vector<std::size_t>& folds);

// Held out, one a trial: of the last model with everything that is named foreseen.
const std::vector<double>& scores_with_all(const Refit& refit);

// What is known of trials that may be outliers, one entry a trial.
struct OutlierLesson {
  std::vector<Pose> ends;  // predicted
  // Measured ends less these, in their axes, by a fit to all trials and by fits to the other folds.
  Residuals residuals, unseen;
  std::vector<std::size_t> folds;
  std::vector<bool> learn;
};
struct PredictedOutliers {
  OutlierDrives outliers;
  NoiseEstimate noise;          // of all drives
  std::vector<double> scores;   // of every trial, by what the other folds show of outliers
  std::vector<double> chances;  // that it was an outlier
};
// Whether a share of the drives are outliers in a way that has no name; nothing where hardly any
// does.
std::optional<PredictedOutliers> look_for_outliers(const DiagnosisRequest& of, const Study& study,
                                                   const OutlierLesson& lesson);
// "7 % of drives end as if ..."
std::string outlier_text(const OutlierDrives& outliers);

}  // namespace gapfarm::steps
