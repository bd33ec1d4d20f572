#include "master/experiments/blind_check/tally.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMaxAliases = 3;  // more say nothing
constexpr double kPromiseTolerance = 0.1;
constexpr double kNearBound[] = {0.9, 1.3};  // of a fit's width, in those of the bound
constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

using Family = std::set<std::string>;

Family family_of(const NamedEffect& effect) {
  Family family = {effect.name};
  const std::size_t count = std::min(effect.aliases.size(), kMaxAliases);
  family.insert(effect.aliases.begin(), effect.aliases.begin() + static_cast<long>(count));
  return family;
}

std::string names_of(const Diagnosis& diagnosis) {
  std::string text = joined(diagnosis.effects, "+", &NamedEffect::name);
  return verdict_name(diagnosis.verdict) + (text.empty() ? "" : " " + text);
}

std::string names_of(const Truth& truth) { return joined(truth.effects, "+", &TrueEffect::name); }

Judgement judge_effects(const Truth& truth, const Diagnosis& diagnosis) {
  const std::string what = names_of(truth);
  if (diagnosis.verdict != Verdict::kEffect && diagnosis.verdict != Verdict::kEffectAndUnknown) {
    return {false, what + "; reported " + verdict_name(diagnosis.verdict)};
  }
  std::vector<NamedEffect> left = diagnosis.effects;
  // By name first: one name may be another one's alias, and be there beside it.
  const auto hit_by = [&](const TrueEffect& effect, bool by_alias) {
    return std::ranges::find_if(left, [&](const NamedEffect& one) {
      return by_alias ? family_of(one).count(effect.name) > 0 : one.name == effect.name;
    });
  };
  std::vector<TrueEffect> others;
  for (const TrueEffect& effect : truth.effects) {
    const auto hit = hit_by(effect, false);
    if (hit == left.end()) others.push_back(effect);
    if (hit != left.end()) left.erase(hit);
  }
  for (const TrueEffect& effect : others) {
    const auto hit = hit_by(effect, true);
    if (hit == left.end()) {
      return {false, what + "; missed " + effect.name + ", reported " + names_of(diagnosis)};
    }
    left.erase(hit);
  }
  if (truth.effects.size() == 1 &&
      family_of(diagnosis.effects.front()).count(truth.effects.front().name) == 0) {
    return {false, what + "; named after " + diagnosis.effects.front().name};
  }
  if (!left.empty()) return {false, what + "; also reported more: " + names_of(diagnosis)};
  return {true, what + "; reported " + names_of(diagnosis)};
}

// Strengths all neutral: places and directions mean nothing.
bool does_nothing(const Effect& entry, const TrueEffect& effect) {
  return std::ranges::all_of(std::span(entry.parameters).first(entry.strengths), [&](auto& p) {
    const double* stated = find_in(effect.parameters, p.key);
    return !stated || *stated == p.nominal;
  });
}

// `turn`: after which the value means the same; 0: never.
bool holds(double lo, double hi, double value, double turn) {
  if (turn == 0) return value >= lo && value <= hi;
  // The turn of `value` that is the first at or above lo.
  return value + turn * std::ceil((lo - value) / turn) <= hi;
}

// Effects without an arrow: half a turn changes nothing, and a quarter of one undoes them.
bool has_no_arrow(const std::string& effect) {
  const std::optional<Polar>& polar = effect_diagnosis(effect).polar;
  return polar && polar->symmetry == 2;
}

// The same effect with its strength above neutral, as a diagnosis shows it.
std::map<std::string, double> as_reported(const TrueEffect& effect) {
  std::map<std::string, double> stated = effect.parameters;
  if (!has_no_arrow(effect.name) || !stated.count("direction")) return stated;
  double *ratio = find_in(stated, "ratio"), *stretch = find_in(stated, "stretch");
  if (!(ratio && *ratio < 1) && !(stretch && *stretch < 0)) return stated;
  if (ratio) *ratio = 1 / *ratio;
  if (stretch) *stretch = -*stretch;
  stated["direction"] += std::numbers::pi / 2;
  return stated;
}

// The first named effect, or the verdict when none is named.
std::string first_reported(const Diagnosis& diagnosis) {
  return diagnosis.effects.empty() ? verdict_name(diagnosis.verdict)
                                   : diagnosis.effects.front().name;
}

// Nats a trial that must be there to explain, for shares of it to mean anything.
constexpr double kLeastGap = 0.02;

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

std::optional<bool> missed_below(const Truth& truth, const Diagnosis& diagnosis) {
  std::optional<bool> below;
  for (const TrueEffect& effect : truth.effects) {
    const bool named = std::ranges::any_of(diagnosis.effects, [&](const NamedEffect& one) {
      return family_of(one).count(effect.name) > 0;
    });
    const Effect* entry = catalogue_entry(effect.name);
    const auto* screened = find_by(diagnosis.screening, effect.name, &Screened::effect);
    if (named || !entry || !screened || truth.kind == CaseKind::kOutside) continue;
    for (std::size_t i = 0; i < entry->strengths; ++i) {
      const Parameter& p = entry->parameters[i];
      const double* value = find_in(effect.parameters, p.key);
      const auto* from = find_by(screened->detectable_from, p.key, [](auto& f) { return f.first; });
      if (!value || !from || !std::isfinite(from->second)) continue;
      below = below.value_or(true) && std::abs(*value - p.nominal) < from->second;
    }
  }
  return below;
}

Judgement judge(const Truth& truth, const Diagnosis& diagnosis) {
  const Verdict verdict = diagnosis.verdict;
  const bool names_none = diagnosis.effects.empty();
  for (const NamedEffect& effect : diagnosis.effects) {
    if (effect.aliases.size() <= kMaxAliases) continue;
    return {false, "more than " + std::to_string(kMaxAliases) + " aliases say nothing"};
  }
  if (truth.kind == CaseKind::kNull) {
    return {verdict == Verdict::kNone && names_none, "null; reported " + names_of(diagnosis)};
  }
  if (truth.kind != CaseKind::kOutside) return judge_effects(truth, diagnosis);
  const bool unknown = verdict == Verdict::kUnknown || verdict == Verdict::kEffectAndUnknown;
  return {unknown && names_none, "outside the catalogue; reported " + names_of(diagnosis)};
}

std::vector<Coverage> coverage_of(const Truth& truth, const Diagnosis& diagnosis) {
  std::vector<Coverage> all;
  for (const TrueEffect& effect : truth.effects) {
    const auto named = std::ranges::find(diagnosis.effects, effect.name, &NamedEffect::name);
    const Effect* entry = catalogue_entry(effect.name);
    if (named == diagnosis.effects.end() || !entry) continue;
    const bool neutral = does_nothing(*entry, effect);
    const std::map<std::string, double> stated = as_reported(effect);
    for (std::size_t i = 0; i < entry->parameters.size(); ++i) {
      const Parameter& p = entry->parameters[i];
      const double* value = find_in(stated, p.key);
      if (!value || !p.choices.empty() || (neutral && i >= entry->strengths)) continue;
      Coverage coverage{effect.name, p.key, *value, kAbsent, kAbsent, false};
      coverage.is_strength = i < entry->strengths;
      for (const Estimate& s : named->parameters) {
        if (s.key != p.key || !std::isfinite(s.lo) || !std::isfinite(s.hi)) continue;
        coverage.lo = s.lo;
        coverage.hi = s.hi;
        // A direction's bounds are a whole turn of it apart.
        const double turn = p.key == "direction" ? p.upper - p.lower : 0;
        coverage.covered = holds(s.lo, s.hi, *value, turn);
        if (!s.sd || !(*s.sd > 0)) continue;
        const double half = kNormal90 * *s.sd;
        coverage.covered_by_fit = holds(s.value - half, s.value + half, *value, turn);
        if (s.bound && *s.bound > 0) coverage.fit_over_bound = *s.sd / *s.bound;
      }
      all.push_back(coverage);
    }
  }
  return all;
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
  const double promised = sum_of(scored.reported->effects, &NamedEffect::closed);
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
