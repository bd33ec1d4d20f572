// Is a diagnosis right?  The rules by which every case is judged.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "master/diagnose/result/diagnosis.h"
#include "master/experiments/blind_check/cases/seal.h"

namespace gapfarm {

constexpr std::size_t kMaxAliases = 3;  // more say nothing

struct Judgement {
  bool right = false;
  std::string why;  // "floor_nap; reported unknown"
};

// A null must be called `none`; what the catalogue does not hold `unknown`, or `effect+unknown`
// naming nothing; a single effect must be the first named or one of its aliases; of a pair both
// must be named; and nothing else may be.
Judgement judge(const Truth& truth, const Diagnosis& diagnosis);

// Whether an effect that is there was not named, and all such have every strength nearer to neutral
// than the diagnosis says that its log shows; none: nothing was missed, or it says of none.
std::optional<bool> missed_below(const Truth& truth, const Diagnosis& diagnosis);

// The first named effect, or the verdict when none is named.
std::string first_reported(const Diagnosis& diagnosis);

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
std::vector<Coverage> coverage_of(const Truth& truth, const Diagnosis& diagnosis);

// The share of the explainable gap that the diagnosis promises its effects close: the sum of
// `closed`, NaN when an effect has none.  0 without effects.
double promised_shrinkage(const Diagnosis& diagnosis);

struct Rate {
  unsigned hits = 0;
  unsigned total = 0;

  void add(bool hit) {
    hits += hit;
    ++total;
  }
  double share() const { return total ? static_cast<double>(hits) / total : 0; }
};

}  // namespace gapfarm
