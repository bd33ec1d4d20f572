// The shape of what nobody can name: a smooth correction of what the last model leaves, and what of
// the catalogue came nearest.

#include <algorithm>
#include <cmath>

#include "common/score/logged_motions.h"
#include "common/score/statistics.h"
#include "master/diagnose/diagnose_steps.h"
#include "master/diagnose/digits.h"
#include "master/diagnose/findings.h"
#include "master/diagnose/intervals.h"
#include "master/diagnose/noise.h"
#include "master/diagnose/tail_noise.h"
#include "master/residual/fit.h"

namespace gapfarm {
namespace {

constexpr std::size_t kLeastFolds = 5, kMostFolds = 8;
constexpr std::size_t kNearestAlone = 3;

// Sessions, joined where there are many and cut into blocks where there are few.
std::vector<std::size_t> residual_folds(const Study& study) {
  const std::size_t sessions = std::max<std::size_t>(study.sessions, 1);
  const std::size_t blocks = (kLeastFolds + sessions - 1) / sessions;
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

std::string percent_words(double share) { return plain_number(std::round(100 * share)) + " %"; }

// "each command's shift by duration and greater duty, in the robot's axes"
std::string term_words(const ResidualTerm& term) {
  std::vector<std::string> labels;
  for (const std::size_t row : term.covariates) {
    labels.emplace_back(residual_covariates()[row].label);
  }
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
      const auto column = static_cast<Eigen::Index>(j);
      if (name == "x") term.centres.col(column).array() += origin.x();
      if (name == "y") term.centres.col(column).array() += origin.y();
    }
  }
  return field;
}

std::string residual_sentence(const FoundResidual& found) {
  if (found.field.empty()) {
    return "A smooth correction of what is left was tried; none surely helps on trials that its "
           "fit did not see, so none is kept.";
  }
  std::vector<std::string> terms;
  for (const ResidualTerm& term : found.field) terms.push_back(term_words(term));
  std::string text;
  for (const std::string& term : terms) text += (text.empty() ? "" : "; ") + term;
  return "A smooth correction without a cause closes " + percent_words(found.closed) + " [" +
         percent_words(found.closed_lo) + ", " + percent_words(found.closed_hi) +
         "] of the gap on trials that its fit did not see: " + text +
         ". model.toml has it as [residual].";
}

}  // namespace

// A correction of what the `k`-th nested fit leaves, scored on trials that neither it nor that fit
// saw, each model with the noise that it leaves.
DiagnosisRun::TriedResidual DiagnosisRun::try_residual(std::size_t k) const {
  const JointFit& last = nested_[k];
  const JointFit& told = final_fit_ ? *final_fit_ : last;
  const Study& study = nested_studies_[k];
  const std::vector<std::size_t> folds = residual_folds(study);
  ResidualData data{logged_motions(problem_),
                    told.ends,
                    study.whitener,
                    folds,
                    std::vector<bool>(study.size(), true),
                    study.free_commands};
  for (std::size_t i = 0; i < study.size(); ++i) data.learn[i] = !study.ignores(i);
  const ResidualFit fit = gapfarm::fit_residual(data, told.residuals, [&](std::size_t fold) {
    return left_without(study, last, folds, fold);
  });
  TriedResidual tried{k, fit.field, {}, {}, {}};
  if (fit.field.empty()) return tried;
  const double share = problem_.fitness.outlier_share;
  const std::vector<Eigen::Vector3d> before = held_out_residuals(study, last, folds);
  std::vector<Eigen::Vector3d> after = before;
  Study beside = study;
  for (std::size_t i = 0; i < study.size(); ++i) {
    after[i] -= fit.unseen[i];
    beside.trials[i].residual = after[i];
  }
  if (slip_.gain == 0 && spreads_.empty()) {
    estimate_noise(Regression(nuisances_, beside.whitened_residuals()), blocks_, &beside);
  }
  if (study.predictive) {
    beside.predictive =
        fit_predictive_noise(beside.trials, after, beside.noise, subject_, share, true).noise;
  }
  tried.without = scores_of(study, before, share);
  tried.with = scores_of(beside, after, share);
  tried.noise = beside.predictive_noise();
  return tried;
}

// Of a correction by effects that are no cause, the smooth one takes the place where it predicts
// better without.
void DiagnosisRun::drop_correction() {
  nested_.pop_back();
  nested_studies_.pop_back();
  nested_scores_.pop_back();
  result_.fits.pop_back();
  std::erase(result_.diagnosis.cautions, correction_);
  correction_.clear();
}

Status DiagnosisRun::fit_residual() {
  Diagnosis& d = result_.diagnosis;
  const bool unexplained =
      d.verdict == Verdict::kUnknown || d.verdict == Verdict::kEffectAndUnknown;
  // A lag found in paths is in the model that is left behind, but not in these fits.
  const bool possible = scenario_form(problem_.scenario).residual && lag_.gain == 0;
  if (!unexplained || !possible) return {};
  FoundResidual& found = d.residual.emplace();
  found.text = residual_sentence(found);
  TriedResidual tried = try_residual(nested_.size() - 1);
  if (!correction_.empty()) {
    TriedResidual alone = try_residual(nested_.size() - 2);
    if (!alone.field.empty() && (tried.field.empty() || mean(alone.with) > mean(tried.with))) {
      tried = std::move(alone);
    }
  }
  if (tried.field.empty() || !clearly_better(tried.with, nested_scores_.back())) return {};
  const auto n = static_cast<double>(tried.with.size());
  std::vector<double> gains = tried.with;
  for (std::size_t i = 0; i < gains.size(); ++i) gains[i] -= tried.without[i];
  const double gained = mean(gains);
  double squares = 0;
  for (const double g : gains) squares += (g - gained) * (g - gained);
  const double half = kNormal90 * std::sqrt(squares) / n;
  NamedEffect shares;
  set_closed(&shares, gains);
  if (!(gained - half > 0 && shares.closed_lo > 0)) return {};
  if (tried.nested + 1 < nested_.size()) drop_correction();
  found = {in_world(tried.field, frame_m_),
           gained,
           gained - half,
           gained + half,
           floor_ - mean(tried.without),
           std::max(0.0, floor_ - mean(tried.with)),
           std::min(1.0, shares.closed),
           std::min(1.0, shares.closed_lo),
           std::min(1.0, shares.closed_hi),
           ""};
  found.text = residual_sentence(found);
  result_.residual = std::move(tried.field);
  residual_noise_ = tried.noise;
  return {};
}

NearMiss DiagnosisRun::near_miss(std::vector<std::string> effects, double gain,
                                 const std::vector<Leftover>& left) const {
  NearMiss miss{std::move(effects), gain, 0, "", ""};
  const bool several = miss.effects.size() > 1;
  miss.text = listed(miss.effects) + (several ? " together" : "") + " would explain " +
              plain_number(std::round(gain)) + " nats, but ";
  if (!left.empty() && left.front().log10_p < subject_.unknown_log10_p) {
    miss.left = left.front().excess;
    miss.left_on = left.front().covariate;
    miss.text += std::string("what ") + (several ? "they leave" : "it leaves") +
                 " still depends on " + miss.left_on + " (" + plain_number(std::round(miss.left)) +
                 " nats).";
  } else {
    miss.text += "there are drives or readings that it does not explain.";
  }
  return miss;
}

// Before anything is given up: `explained` holds what was chosen.
void DiagnosisRun::note_nearest(const Regression& explained) {
  std::vector<NearMiss>& nearest = result_.diagnosis.nearest;
  if (!chosen_.empty()) {
    std::vector<std::string> together;
    for (const ChosenEffect& c : chosen_) together.push_back(c.candidate.signature.effect);
    nearest.push_back(near_miss(std::move(together), explained_nats(explained), leftovers_));
  }
  for (std::size_t k = 0; k < std::min(kNearestAlone, candidates_.size()); ++k) {
    const Signature& s = candidates_[k].signature;
    const bool told = chosen_.size() == 1 && chosen_.front().candidate.signature.effect == s.effect;
    if (!(candidates_[k].gain > 0) || told) continue;
    Regression with = *base_;
    Eigen::MatrixXd columns = s.columns;
    study_.drop_ignored(columns);
    with.add(columns);
    nearest.push_back(near_miss({s.effect}, candidates_[k].gain, leftovers(with, blocks_)));
  }
}

}  // namespace gapfarm
