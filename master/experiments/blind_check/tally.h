// The blind check's result: every case scored, and what they add up to.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/config/settings.h"
#include "common/residual/field.h"
#include "master/experiments/blind_check/cases/design.h"
#include "master/experiments/blind_check/children.h"
#include "master/experiments/blind_check/score.h"
#include "master/farm/farm.h"

namespace gapfarm {

// Mean log score of a fresh log (nats a trial) under three models.
struct FreshScores {
  double tuned = 0;
  double final_ = 0;  // without the [residual], of which no promise knows
  double truth = 0;
  std::optional<double> corrected;  // with it, where there is one
};

// (final - tuned) / (truth - tuned): the share of the explainable gap that really went.  None where
// there is too little to explain (0.02 nats a trial) for the share to mean anything.
std::optional<double> realised_shrinkage(const FreshScores& scores);

// Whether model.toml, its [residual] included, closes half of what the truth does.  None where
// there is too little to close.
std::optional<bool> closes_half(const FreshScores& scores);

struct ScoredCase {
  Truth truth;  // foreign cases without a truth: the id alone
  bool has_truth = true;
  ChildEnd end;
  std::optional<Diagnosis> reported;  // none: the diagnosis failed
  Judgement judgement;
  std::vector<Coverage> coverage;
  std::optional<double> promised;  // of named effects only
  std::optional<FreshScores> fresh;
  std::optional<double> realised;
};

// Judges a case; a diagnosis that failed is wrong.
ScoredCase score_case(const Truth& truth, const ChildEnd& end, std::optional<Diagnosis> reported);

constexpr double kPromiseTolerance = 0.1;
constexpr double kNearBound[] = {0.9, 1.3};  // of a fit's width, in those of the bound

struct Tally {
  Rate right;            // of all
  Rate failed;           // diagnoses that crashed, ended late or left no answer, of all
  Rate null_none;        // nulls called none
  Rate false_alarms;     // nulls in which an effect was named
  Rate outside_unknown;  // effects outside the catalogue called unknown, naming nothing
  Rate outside_closed;   // of these, models that close half of what the truth does
  Rate pairs_right;
  Rate covered;                            // true parameters within their interval
  Rate strengths_covered, places_covered;  // of these: Coverage::is_strength, and the others
  Rate fits_covered;                       // the same by the fit's own intervals
  Rate fits_at_bound;                      // which are 0.9 to 1.3 times as wide as the bound
  Rate
      missed_below;  // of missed effects of which the diagnosis says it: smaller than its log shows
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

// What a diagnosis really gained: its models against the truth on a fresh log of the same robot.

// A case whose diagnosis left its models.
struct DiagnosedCase {
  Truth truth;
  ParameterValues tuned;   // of the base alone
  ParameterValues final_;  // with the named effects
  Residual residual;       // that its model.toml adds; may be empty
};

// tuned.toml and model.toml in `folder`; none when one is missing or of another scenario.
std::optional<DiagnosedCase> read_diagnosed_case(const Truth& truth, const std::string& folder);

// For each case, simulates a second log of its truth (other noise and, without `plan`, another
// plan), and has the tuned base, the diagnosis's model, with its [residual] where it has one, and
// the truth predict it.  None for a case in which a prediction did not end well.  Errors: the
// farm's own.
Result<std::vector<std::optional<FreshScores>>> score_fresh_logs(
    const Config& config, const std::vector<DiagnosedCase>& cases, const SessionPlans& plan,
    Farm& farm, const DesignProgress& progress = {});

}  // namespace gapfarm
