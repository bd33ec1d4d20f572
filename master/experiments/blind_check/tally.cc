#include "master/experiments/blind_check/tally.h"

#include <cmath>

#include "common/base/ranges.h"
#include "common/config/model.h"
#include "common/math/statistics.h"
#include "master/experiments/crossfit/crossfit.h"
#include "master/farm/planned_trials.h"

namespace gapfarm {
namespace {

// Nats a trial that must be there to explain, for shares of it to mean anything.
constexpr double kLeastGap = 0.02;

std::optional<double> mean_log_score(const PredictedEnds& predicted) {
  if (predicted.log_scores.empty()) return std::nullopt;
  return mean(predicted.log_scores);
}

// What the truth gains over the tuned base; none: too little.
std::optional<double> gap_of(const FreshScores& scores) {
  const double gap = scores.truth - scores.tuned;
  return gap >= kLeastGap ? std::optional(gap) : std::nullopt;
}

std::string truth_family(const Truth& truth) {
  if (truth.kind == CaseKind::kSingle) return truth.effects.front().name;
  return truth.kind == CaseKind::kNull ? "none" : case_kind_name(truth.kind);
}

void add_kind(const ScoredCase& c, Tally& sum) {
  const bool right = c.judgement.right;
  switch (c.truth.kind) {
    case CaseKind::kNull:
      sum.null_none.add(right);
      sum.false_alarms.add(c.reported && !c.reported->effects.empty());
      return;
    case CaseKind::kOutside:
      sum.outside_unknown.add(right);
      if (const auto half = c.fresh ? closes_half(*c.fresh) : std::nullopt) {
        sum.outside_closed.add(*half);
      }
      return;
    case CaseKind::kPair:
      sum.pairs_right.add(right);
      return;
    case CaseKind::kSingle:
      break;
  }
  const std::string& name = c.truth.effects.front().name;
  sum.singles_right[c.truth.level].add(right);
  sum.singles_first[c.truth.level].add(right && first_reported(*c.reported) == name);
  sum.by_effect[name][c.truth.level].add(right);
}

}  // namespace

std::optional<DiagnosedCase> read_diagnosed_case(const Truth& truth, const std::string& folder) {
  const Result<Model> tuned = read_model(folder + "/tuned.toml");
  const Result<Model> final_model = read_model(folder + "/model.toml");
  if (!tuned || !final_model || tuned->scenario != final_model->scenario) return std::nullopt;
  return DiagnosedCase{truth, tuned->values, final_model->values, final_model->residual};
}

Result<std::vector<std::optional<FreshScores>>> score_fresh_logs(
    const Config& config, const std::vector<DiagnosedCase>& cases, const SessionPlans& plan,
    Farm& farm) {
  const std::vector<Truth> truths = mapped(cases, &DiagnosedCase::truth);
  ASSIGN_OR_RETURN(std::vector<TrialLog> logs,
                   simulate_cases(config, truths, plan, /*seed_offset=*/1, farm));
  std::vector<std::optional<FreshScores>> scores;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    Problem problem = without_log(config.problem);
    problem.log = std::move(logs[i]);
    for (Trial& trial : problem.log.trials) trial.path.clear();
    for (const v1::Override& o : overrides_of(problem.table(), truths[i])) {
      problem.values[o.parameter()] = o.value();
    }
    ASSIGN_OR_RETURN(
        const auto predicted,
        predict_ends(problem, {cases[i].tuned, cases[i].final_, problem.values}, farm, true));
    const auto tuned = mean_log_score(predicted[0]);
    const auto final_score = mean_log_score(predicted[1]);
    const auto truth = mean_log_score(predicted[2]);
    scores.emplace_back();
    if (tuned && final_score && truth) {
      scores.back() = FreshScores{*tuned, *final_score, *truth, std::nullopt};
    }
    if (scores.back() && !cases[i].residual.empty()) {
      Problem corrected = problem;
      corrected.residual = cases[i].residual;
      ASSIGN_OR_RETURN(const auto with_residual,
                       predict_ends(corrected, {cases[i].final_}, farm, true));
      scores.back()->corrected = mean_log_score(with_residual.front());
    }
  }
  return scores;
}

std::optional<double> realised_shrinkage(const FreshScores& scores) {
  const std::optional<double> gap = gap_of(scores);
  if (!gap) return std::nullopt;
  return (scores.final_ - scores.tuned) / *gap;
}

std::optional<bool> closes_half(const FreshScores& scores) {
  const std::optional<double> gap = gap_of(scores);
  if (!gap) return std::nullopt;
  return scores.corrected.value_or(scores.final_) - scores.tuned >= *gap / 2;
}

ScoredCase score_case(const Truth& truth, const ChildEnd& end, std::optional<Diagnosis> reported) {
  ScoredCase scored;
  scored.truth = truth;
  scored.end = end;
  scored.reported = std::move(reported);
  if (!scored.reported) {
    scored.judgement = {false, "no diagnosis: it " + (end.text.empty() ? "left none" : end.text)};
    return scored;
  }
  scored.judgement = judge(truth, *scored.reported);
  if (const auto below = missed_below(truth, *scored.reported); below && !scored.judgement.right) {
    scored.judgement.why += *below ? "; below what this log shows" : "; ours: this log shows it";
  }
  scored.coverage = coverage_of(truth, *scored.reported);
  const double promised = promised_shrinkage(*scored.reported);
  if (!scored.reported->effects.empty() && std::isfinite(promised)) scored.promised = promised;
  return scored;
}

Tally tally(const std::vector<ScoredCase>& cases) {
  Tally sum;
  for (const ScoredCase& c : cases) {
    if (!c.has_truth) continue;
    sum.right.add(c.judgement.right);
    sum.failed.add(!c.reported);
    const auto below = c.reported ? missed_below(c.truth, *c.reported) : std::nullopt;
    if (below && !c.judgement.right) sum.missed_below.add(*below);
    add_kind(c, sum);
    ++sum.confusion[truth_family(c.truth)][c.reported ? first_reported(*c.reported) : "failed"];
    for (const Coverage& coverage : c.coverage) {
      sum.covered.add(coverage.covered);
      (coverage.is_strength ? sum.strengths_covered : sum.places_covered).add(coverage.covered);
      sum.covered_by_parameter[coverage.effect + "." + coverage.key].add(coverage.covered);
      if (coverage.covered_by_fit) sum.fits_covered.add(*coverage.covered_by_fit);
      if (!coverage.fit_over_bound) continue;
      sum.fits_at_bound.add(*coverage.fit_over_bound >= kNearBound[0] &&
                            *coverage.fit_over_bound <= kNearBound[1]);
    }
    if (c.promised && c.realised) {
      sum.promise_kept.add(std::abs(*c.promised - *c.realised) <= kPromiseTolerance);
    }
  }
  return sum;
}

}  // namespace gapfarm
