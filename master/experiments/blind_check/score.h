// Is a diagnosis right?  The rules by which every case is judged.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/interval.h"
#include "common/base/result.h"
#include "master/experiments/blind_check/cases/seal.h"

namespace gapfarm {

// A diagnosis as the outside sees it (diagnosis.json): what the blind check judges.
struct ReportedParameter {
  std::string key;
  double value = 0;
  double lo = 0;  // 90 % interval
  double hi = 0;
  double sd = 0;     // of the fit alone; NaN where the diagnosis has none
  double bound = 0;  // Cramer and Rao's; likewise
};

struct ReportedEffect {
  std::string name;
  std::vector<std::string> aliases;
  double confidence = 0;
  std::vector<ReportedParameter> parameters;
  double closed = 0;  // share of the explainable gap
};

struct Reported {
  std::string verdict;  // "effect", "none", "unknown", "effect+unknown"
  std::vector<ReportedEffect> effects;
  // "floor_tilt.angle": how far from neutral it would have been named (Screened::detectable_from).
  std::map<std::string, double> detectable_from = {};
};

// Parameters without numbers and an absent `closed` (as NaN) are let pass: they cost coverage, not
// the case.  Errors: not JSON, no known verdict, an effect without a name.
Result<Reported> parse_reported(const std::string& text, const std::string& file);

constexpr std::size_t kMaxAliases = 3;  // more say nothing

struct Judgement {
  bool right = false;
  std::string why;  // "floor_nap; reported unknown"
};

// A null must be called `none`; what the catalogue does not hold `unknown`, or `effect+unknown`
// naming nothing; a single effect must be the first named or one of its aliases; of a pair both
// must be named; and nothing else may be.
Judgement judge(const Truth& truth, const Reported& reported);

// Whether an effect that is there was not named, and all such have every strength nearer to neutral
// than the diagnosis says that its log shows; none: nothing was missed, or it says of none.
std::optional<bool> missed_below(const Truth& truth, const Reported& reported);

// The first named effect, or the verdict when none is named.
std::string first_reported(const Reported& reported);

// Whether the interval of one true parameter held it.
struct Coverage {
  std::string effect;
  std::string key;
  double truth = 0;
  double lo = 0;  // NaN when the diagnosis gave no interval
  double hi = 0;
  bool covered = false;
  bool is_strength = true;  // or a place, a direction, ... that means nothing without one
  // Of the fit alone: whether its 90 % held it, and its width over the bound; none: no such
  // interval.
  std::optional<bool> covered_by_fit = {};
  std::optional<double> fit_over_bound = {};
};

// One entry a parameter of every true effect that was named by its own name: an alias has other
// parameters.  Angles are compared on the circle.  Omitted: choices (they have no interval) and
// what means nothing since the effect's strengths are neutral.
std::vector<Coverage> coverage_of(const Truth& truth, const Reported& reported);

// The share of the explainable gap that the diagnosis promises its effects close: the sum of
// `closed`, NaN when an effect has none.  0 without effects.
double promised_shrinkage(const Reported& reported);

struct Rate {
  unsigned hits = 0;
  unsigned total = 0;

  void add(bool hit) {
    hits += hit;
    ++total;
  }
  double share() const { return total ? static_cast<double>(hits) / total : 0; }
};

// 95 % score interval for a binomial share (Wilson 1927); [0, 1] for no trials.
Interval wilson_interval(const Rate& rate);

}  // namespace gapfarm
