#include "master/experiments/blind_check/tally.h"

#include <cmath>

namespace gapfarm {
namespace {

std::string truth_family(const Truth& truth) {
  switch (truth.kind) {
    case CaseKind::kNull:
      return "none";
    case CaseKind::kOutside:
      return "outside";
    case CaseKind::kPair:
      return "pair";
    case CaseKind::kSingle:
      break;
  }
  return truth.effects.front().name;
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

std::optional<double> realised_shrinkage(const FreshScores& scores, double least_gap) {
  const double gap = scores.truth - scores.tuned;
  if (!(gap >= least_gap)) return std::nullopt;
  return (scores.final_ - scores.tuned) / gap;
}

std::optional<bool> closes_half(const FreshScores& scores, double least_gap) {
  const double gap = scores.truth - scores.tuned;
  if (!(gap >= least_gap)) return std::nullopt;
  return scores.corrected.value_or(scores.final_) - scores.tuned >= gap / 2;
}

ScoredCase score_case(const Truth& truth, const ChildEnd& end, std::optional<Reported> reported) {
  ScoredCase scored;
  scored.truth = truth;
  scored.end = end;
  scored.reported = std::move(reported);
  if (!scored.reported) {
    scored.judgement = {false, "no diagnosis: it " + (end.text.empty() ? "left none" : end.text)};
    return scored;
  }
  scored.judgement = judge(truth, *scored.reported);
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
    add_kind(c, sum);
    ++sum.confusion[truth_family(c.truth)][c.reported ? first_reported(*c.reported) : "failed"];
    for (const Coverage& coverage : c.coverage) {
      sum.covered.add(coverage.covered);
      (coverage.is_strength ? sum.strengths_covered : sum.places_covered).add(coverage.covered);
      sum.covered_by_parameter[coverage.effect + "." + coverage.key].add(coverage.covered);
    }
    if (c.promised && c.realised) {
      sum.promise_kept.add(std::abs(*c.promised - *c.realised) <= kPromiseTolerance);
    }
  }
  return sum;
}

}  // namespace gapfarm
