// The blind check's result: every case scored, and what they add up to.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "master/experiments/blind_check/children.h"
#include "master/experiments/blind_check/score.h"

namespace gapfarm {

// Mean log score of a fresh log (nats a trial) under three models.
struct FreshScores {
  double tuned = 0;
  double final_ = 0;  // without the [residual], of which no promise knows
  double truth = 0;
  std::optional<double> corrected;  // with it, where there is one
};

// (final - tuned) / (truth - tuned): the share of the explainable gap that really went.  None where
// there is too little to explain (below `least_gap`, nats a trial) for the share to mean anything.
std::optional<double> realised_shrinkage(const FreshScores& scores, double least_gap = 0.02);

// Whether model.toml, its [residual] included, closes half of what the truth does.  None where
// there is too little to close.
std::optional<bool> closes_half(const FreshScores& scores, double least_gap = 0.02);

struct ScoredCase {
  Truth truth;  // foreign cases without a truth: the id alone
  bool has_truth = true;
  ChildEnd end;
  std::optional<Reported> reported;  // none: the diagnosis failed
  Judgement judgement;
  std::vector<Coverage> coverage;
  std::optional<double> promised;  // of named effects only
  std::optional<FreshScores> fresh;
  std::optional<double> realised;
};

// Judges a case; a diagnosis that failed is wrong.
ScoredCase score_case(const Truth& truth, const ChildEnd& end, std::optional<Reported> reported);

constexpr double kPromiseTolerance = 0.1;

struct Tally {
  Rate right;            // of all
  Rate failed;           // diagnoses that crashed, ended late or left no answer, of all
  Rate null_none;        // nulls called none
  Rate false_alarms;     // nulls in which an effect was named
  Rate outside_unknown;  // effects outside the catalogue called unknown, naming nothing
  Rate outside_closed;   // of these, models that close half of what the truth does
  Rate pairs_right;
  Rate covered;                               // true parameters within their interval
  Rate strengths_covered, places_covered;     // of these: Coverage::is_strength, and the others
  Rate promise_kept;                          // |promised - realised| <= kPromiseTolerance
  std::map<std::string, Rate> singles_right;  // by level
  std::map<std::string, Rate> singles_first;  // by level; the true name itself came first
  std::map<std::string, std::map<std::string, Rate>> by_effect;  // effect, level
  std::map<std::string, Rate> covered_by_parameter;              // "floor_tilt.angle"
  // True effect ("none", "outside", "pair") by what was reported first ("failed" when nothing).
  std::map<std::string, std::map<std::string, unsigned>> confusion;
};

// Cases without a truth count nowhere.
Tally tally(const std::vector<ScoredCase>& cases);

}  // namespace gapfarm
