// What the catalogue offers, and what of it the log calls for.

#include <cmath>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/math/laws.h"
#include "common/math/statistics.h"
#include "master/diagnose/evidence/noise.h"
#include "master/diagnose/fit/signatures.h"
#include "master/diagnose/steps/step_parts.h"
#include "master/diagnose/steps/watch.h"
#include "master/infer/settings.h"

namespace gapfarm::steps {
namespace {

std::vector<Screened> screened(const DiagnosisRequest& of, const Evidence& evidence,
                               const std::vector<EffectCandidate>& candidates) {
  const ParameterTable& table = of.table();
  std::vector<Eigen::VectorXd> explained = mapped(candidates, [&](const EffectCandidate& c) {
    return evidence.base.explained(c.signature.columns);
  });
  std::vector<Screened> rows;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Signature& s = candidates[i].signature;
    Screened row;
    row.effect = s.effect;
    row.gain = candidates[i].gain;
    const Gain gain = evidence.base.gain(s.columns);
    if (gain.dimensions == 0) {
      row.note = "cannot be seen in this log: the base model absorbs all that it would do";
    } else {
      row.p = chi_squared_above(gain.dimensions, gain.squares);
    }
    Overrides start;
    const auto values = start_values(evidence.study, evidence.base, s);
    set_values(table, values, &start);
    for (const auto& [key, value] : values) {
      if (key.rfind(s.effect + ".", 0) != 0) continue;
      row.estimate +=
          (row.estimate.empty() ? "" : ", ") + value_text(of, table.row(key), value, start);
    }
    for (std::size_t j = 0; j < candidates.size(); ++j) {
      const double lengths = explained[i].norm() * explained[j].norm();
      if (i == j || lengths == 0) continue;
      if (std::abs(explained[i].dot(explained[j])) > kAliasCosine * lengths) {
        row.alias_set.push_back(candidates[j].effect());
      }
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

// Beside a strong effect on the mean no outliers visibly; with it explained some may.
Result<Screening> look_for_spreads_beside(const DiagnosisRequest& of, Screening screening) {
  for (;;) {
    Explanation& found = screening.found;
    const std::size_t before = found.spreads.size(), lone = found.lone.size();
    const Regression explained = explained_by(*screening.catalogue, found);
    ASSIGN_OR_RETURN(found, leave_lone_out(of, found, explained));
    if (found.lone.size() == lone) {
      found = look_for_spreads(of, found, explained,
                               std::max(0.0, explained_nats(*screening.catalogue, explained)));
    }
    if (found.spreads.size() == before && found.lone.size() == lone) return screening;
    ASSIGN_OR_RETURN(screening, compete(of, std::move(found)));
  }
}

// What the chosen effects leave of every trial, sessions' gains left in.
std::vector<Eigen::Vector3d> left_with_sessions(const Explanation& found) {
  if (found.estimates) return found.estimates->residuals;
  const Study& study = found.study();
  const Eigen::MatrixXd& all = found.evidence->nuisances;
  const auto sessions =
      found.names_session_gains() ? static_cast<Eigen::Index>(study.sessions) : Eigen::Index{0};
  Eigen::VectorXd residuals = study.whitened_residuals();
  study.drop_ignored(residuals);
  Regression explained(all.rightCols(all.cols() - sessions), residuals);
  for (const EffectCandidate& c : found.chosen) explained.add(c.signature.columns);
  return study.unwhiten(explained.left());
}

// Beside a strong effect on the mean sessions may seem alike; with it explained they may not be.
Result<Screening> look_for_session_gains_again(const DiagnosisRequest& of, Screening screening) {
  Explanation& found = screening.found;
  if (found.names_session_gains() || found.chosen.empty()) return screening;
  found = look_for_session_gains(of, found, left_with_sessions(found));
  if (!found.names_session_gains()) return screening;
  return compete(of, std::move(found));
}

bool base_is_on_bounds(const Explanation& found) {
  return !base_on_bounds(found.study(), found.study().base).empty();
}

// Where there is nothing to explain, a base on its bounds misleads nobody: what trials do not show
// of one another's sizes may lie anywhere.
Result<std::optional<Screening>> nothing_to_explain(const DiagnosisRequest& of,
                                                    const Explanation& nothing) {
  Screening screening;
  screening.found = look_for_spreads(of, nothing, nothing.evidence->base);
  const Explanation& found = screening.found;
  const Study& study = found.study();
  const double share = of.outlier_share();
  const double gap = floor_score(study, share) - mean(scores_of(study, study.residuals(), share));
  if (found.names_anything() || !found.odd_drives.empty() || gap > kMostOfNothing) {
    return std::optional<Screening>();
  }
  ASSIGN_OR_RETURN(screening.catalogue, marks_of(of, found));
  const auto left = all_leftovers(found, explained_by(*screening.catalogue, found));
  if (!left.empty() && left.front().log10_p < kUnknownLog10P) return std::optional<Screening>();
  RETURN_IF_ERROR(screen_alone(of, found, &screening));
  return std::optional(std::move(screening));
}

// What draws a base to its bounds is strong; beside it the base comes free, and hypotheses compete
// once more from there, by the noise that these leave.
Result<Screening> compete_from_free_base(const DiagnosisRequest& of, Explanation found) {
  auto freed = compete(of, std::move(found));
  if (!freed || freed->found.chosen.empty() || base_is_on_bounds(freed->found)) return freed;
  found = std::move(freed->found);
  Study study = found.study();
  std::erase_if(study.base,
                [&](const auto& entry) { return !of.table()[entry.first].effect.empty(); });
  if (Status s = of.subject.tune(of.predictor, /*keep=*/true, &study); !s) return s.error();
  ASSIGN_OR_RETURN(auto evidence, evidence_of(of, std::move(study)));
  found.evidence = std::make_shared<const Evidence>(std::move(evidence));
  return compete(of, std::move(found));
}

// Whether something would have been named, were it sure.
bool offers_enough(const Screening& screening, double least_gain) {
  return std::ranges::any_of(screening.steps, [&](const SelectionRecord& step) {
    return std::ranges::any_of(step.offered,
                               [&](const auto& offer) { return offer.second >= least_gain; });
  });
}

// Alone the base may have been tuned to where slopes say nothing of it beside what moves the robot.
// Where what competes beside them leaves too much to be named, base and hypotheses are searched
// together; with so much room they have to leave nothing, where anything else is named.
Result<Screening> compete_from_both(const DiagnosisRequest& of, Explanation beside) {
  auto held = compete(of, beside);
  if (!held || of.subject.base_moves || of.options.keep_base) return held;
  if (held->found.chosen.empty()) {
    if (!offers_enough(*held, of.subject.least_gain)) return held;
  } else {
    ASSIGN_OR_RETURN(const auto beside_held, judge(of, *held));
    if (beside_held.verdict != Verdict::kUnknown) return held;
  }
  beside.frees_base = true;
  auto freed = compete_from_free_base(of, std::move(beside));
  if (!freed && freed.error().code == ErrorCode::kSimulation) return held;
  if (!freed) return freed;
  if (freed->found.chosen.empty() || base_is_on_bounds(freed->found)) return held;
  ASSIGN_OR_RETURN(const auto beside_freed, judge(of, *freed));
  const bool better = beside_freed.verdict == Verdict::kEffect ||
                      (held->found.chosen.empty() && beside_freed.verdict != Verdict::kUnknown);
  return better ? std::move(freed) : std::move(held);
}

Result<Screening> look_beside_readings(const DiagnosisRequest& of, const Explanation& found) {
  ASSIGN_OR_RETURN(Explanation beside, leave_lone_out(of, found, found.evidence->base));
  beside = look_for_spreads(of, beside, beside.evidence->base);
  auto screening = found.frees_base ? compete_from_free_base(of, std::move(beside))
                                    : compete_from_both(of, std::move(beside));
  if (screening && found.frees_base && base_is_on_bounds(screening->found)) return screening;
  if (screening) screening = look_for_session_gains_again(of, std::move(*screening));
  if (screening) screening = look_for_spreads_beside(of, std::move(*screening));
  return screening;
}

// Sessions that seem to differ are measured again with what they have of their own taken out.
Result<Screening> look_for_all(const DiagnosisRequest& of, Explanation partial) {
  auto found = look_for_late_readings(of, std::move(partial));
  if (found) found = look_for_lag(of, std::move(*found));
  if (!found) return found.error();
  const Study& study = found->study();
  Explanation differ =
      look_for_session_gains(of, *found, study.unwhiten(study.whitened_residuals()));
  if (!differ.names_session_gains()) return look_beside_readings(of, *found);
  ASSIGN_OR_RETURN(auto measured, measure(of, differ.study()));
  differ.evidence = std::make_shared<const Evidence>(std::move(measured));
  return look_beside_readings(of, differ);
}

}  // namespace

Result<Relinearised> relinearised_at(const DiagnosisRequest& of, const Study& study,
                                     const JointFit& fit,
                                     const std::vector<EffectCandidate>& effects) {
  const ParameterTable& table = of.table();
  std::vector<PredictionRequest> without;
  for (const EffectCandidate& effect : effects) {
    without.push_back({fit.at, {}});
    std::erase_if(without.back().at,
                  [&](const auto& entry) { return table[entry.first].effect == effect.effect(); });
  }
  ASSIGN_OR_RETURN(const auto ends, of.predictor.attempt(without));
  for (const auto& simulated : ends) {
    if (!simulated) return Relinearised{};
  }
  Relinearised at_estimate{study.whiten(fit.residuals), {}};
  for (std::size_t k = 0; k < effects.size(); ++k) {
    const std::string& name = effects[k].effect();
    std::vector<Eigen::Index> own;
    for (std::size_t p = 0; p < fit.parameters.size(); ++p) {
      if (table[fit.parameters[p].row].effect == name) own.push_back(static_cast<Eigen::Index>(p));
    }
    Eigen::MatrixXd columns(at_estimate.data.size(), static_cast<Eigen::Index>(own.size()) + 1);
    std::vector<Eigen::Vector3d> contribution;
    for (std::size_t i = 0; i < study.size(); ++i) {
      contribution.push_back(difference_of(study.trials[i], (*ends[k])[i], fit.ends[i]));
    }
    columns.col(0) = study.whiten(contribution);
    columns.rightCols(columns.cols() - 1) = fit.jacobian(Eigen::all, own);
    at_estimate.data += columns.col(0);
    study.drop_ignored(columns);
    at_estimate.columns.push_back(std::move(columns));
  }
  study.drop_ignored(at_estimate.data);
  return at_estimate;
}

Result<std::unique_ptr<Proposals>> marks_of(const DiagnosisRequest& of, const Explanation& found) {
  std::vector<std::string> excluded = of.options.excluded;
  if (found.lag.trials > 0) excluded.emplace_back("motor_lag");
  const Evidence& evidence = *found.evidence;
  ASSIGN_OR_RETURN(auto signatures, of.subject.signatures(of.predictor, evidence.study, excluded));
  for (Signature& s : signatures) evidence.study.drop_ignored(s.columns);
  auto marks = std::make_unique<Proposals>(of.predictor, evidence.study, std::move(signatures),
                                           evidence.base);
  marks->exclude({of.options.excluded.begin(), of.options.excluded.end()});
  if (!of.excluded(kPatchEffect)) marks->look_for_patches();
  return marks;
}

Status screen_alone(const DiagnosisRequest& of, const Explanation& found, Screening* screening) {
  Explanation before = found;
  before.chosen.clear();
  ASSIGN_OR_RETURN(auto alone, screening->catalogue->candidates(
                                   explained_by(*screening->catalogue, before), {}));
  screening->rows = screened(of, *found.evidence, alone);
  emit_candidates(of, alone);
  screening->alone = std::move(alone);
  return {};
}

std::string value_text(const DiagnosisRequest& of, std::size_t row, double value,
                       const Overrides& at) {
  const std::string& key = of.table()[row].key;
  return key.substr(key.find('.') + 1) + " " +
         of.table().format(row, rounded_to_digits(value + of.frame_of(key, at), 4));
}

double sum_of_gains(const std::vector<EffectCandidate>& chosen) {
  double sum = 0;
  for (const EffectCandidate& c : chosen) sum += c.gain;
  return sum;
}

Regression explained_by(const Proposals& catalogue, const Explanation& explanation) {
  return catalogue.with(explanation.first, explanation.chosen);
}

double explained_nats(const Proposals& catalogue, const Regression& explained) {
  return (catalogue.nothing_explained().left_squares() - explained.left_squares()) / 2;
}

Result<Screening> screen(const DiagnosisRequest& of, const Evidence& measured) {
  Explanation nothing;
  nothing.evidence = std::make_shared<const Evidence>(measured);
  const bool bounded = !measured.study.on_bounds.empty();
  nothing.frees_base = bounded;
  auto screening = look_for_all(of, nothing);
  if (!bounded) return screening;
  // A base on its bounds may be one that cannot be simulated with much of the catalogue.
  const bool fell = !screening && screening.error().code == ErrorCode::kSimulation;
  if (fell ||
      (screening && (screening->found.chosen.empty() || base_is_on_bounds(screening->found)))) {
    nothing.frees_base = false;
    if (!fell && !screening->found.names_anything()) {
      ASSIGN_OR_RETURN(auto sound, nothing_to_explain(of, nothing));
      if (sound) return std::move(*sound);
    }
    Screening none;
    none.found = std::move(nothing);
    none.warning = on_bounds(of, measured.study);
    return none;
  }
  return screening;
}

}  // namespace gapfarm::steps
