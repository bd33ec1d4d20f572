// The blind check's result: every case scored, and what they add up to.
#pragma once

#include <functional>
#include <utility>

#include "common/process/stop.h"
#include "common/residual/field.h"
#include "master/diagnose/result/diagnosis.h"
#include "master/experiments/blind_check/cases/design.h"

namespace gapfarm {

// Runs jobs in child processes, a few at a time, each with a time limit.

struct ChildJob {
  std::string id;
  std::vector<std::string> argv;  // argv[0]: path of the program
  std::string log_path;           // its stdout and stderr
};

enum class ChildState { kDone, kFailed, kCrashed, kTimedOut };
const char* child_state_name(ChildState state);  // "done", "failed", "crashed", "timeout"

struct ChildEnd {
  ChildState state = ChildState::kDone;
  int status = 0;  // exit status, or the signal of a crash
  double wall_s = 0;
  std::string text;  // "exited with status 3"; empty when done
  double cpu_s = 0;  // of the child and of its own children that it waited for
};

struct ChildrenOptions {
  unsigned at_once = 1;
  double time_limit_s = 1800;
  StopSource* stop = nullptr;  // not owned
  // Exit statuses that count as done.
  std::function<bool(int status)> done = [](int status) { return status == 0; };
  std::function<void(const ChildJob& job, const ChildEnd& end)> on_end;
  std::function<void(std::size_t ended)> on_tick = [](std::size_t) {};  // now and then
};

// Runs all jobs in order; returns when the last has ended.  Every child leads a process group of
// its own (a terminal's Ctrl-C does not reach it), inherits no descriptor, and dies with this
// thread; a child beyond its limit is asked to end, then made to, with all its group. Errors:
// kStopped, after the running children were ended (they are not reported); a program that
// cannot be started.
Status run_children(const std::vector<ChildJob>& jobs, const ChildrenOptions& options);

// Is a diagnosis right?  The rules by which every case is judged.

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

struct Rate {
  unsigned hits = 0;
  unsigned total = 0;

  void add(bool hit) {
    hits += hit;
    ++total;
  }
  double share() const { return total ? static_cast<double>(hits) / total : 0; }
};

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
  Rate promise_kept;                          // |promised - realised| <= 0.1
  std::map<std::string, Rate> singles_right;  // by level
  std::map<std::string, Rate> singles_first;  // by level; the true name itself came first
  std::map<std::string, std::map<std::string, Rate>> by_effect;  // effect, level
  std::map<std::string, Rate> covered_by_parameter;              // "floor_tilt.angle"
  // True effect ("none", "outside", "pair") by what was reported first ("failed" when nothing).
  std::map<std::string, std::map<std::string, unsigned>> confusion;
};

// Cases without a truth count nowhere.
Tally tally(const std::vector<ScoredCase>& cases);

// The blind check's result for people and for programs.

struct BlindReport {
  std::vector<std::pair<std::string, std::string>> provenance;  // label and value
  std::vector<ScoredCase> cases;
  std::vector<OutOfReach> out_of_reach;
};

// blind_check.json: provenance, rates with 95 % Wilson intervals, confusion matrix, cases.
std::string format_blind_json(const BlindReport& report);
// blind_check.md: the same as tables.
std::string format_blind_markdown(const BlindReport& report);
// The rates alone, for a terminal.
std::string format_blind_summary(const BlindReport& report);

}  // namespace gapfarm
