// What a diagnosis says: the plain data behind diagnosis.json (docs/formats.md) and the report.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/pose/pose.h"
#include "common/residual/outliers.h"
#include "common/trials/trial.h"
#include "master/diagnose/result/parameter_row.h"
#include "master/io/log_checks/log_checks.h"

namespace gapfarm {

enum class Verdict { kEffect, kNone, kUnknown, kEffectAndUnknown, kUnusable };
// "effect", "none", "unknown", "effect+unknown", "unusable"
const char* verdict_name(Verdict verdict);

struct Estimate {
  std::string key;  // within the effect: "rate"
  double value = 0;
  double lo = 0;  // 90 % interval
  double hi = 0;
  std::string unit;
  // Standard deviation that no unbiased estimate could beat on this log (Cramer, Rao), beside base
  // and nuisances, by slopes at the fit; and what the interval's is over it.
  std::optional<double> bound = {};
  std::optional<double> width_over_bound = {};
  // Standard deviation of the fit alone: the estimate's own, as far as the simulation moves as the
  // robot does.  The interval has what it may be off by besides.
  std::optional<double> sd = {};
};

// How much faster one session drives than the base, as a share.
struct SessionGain {
  double gain = 0;
  double lo = 0;  // 90 % interval
  double hi = 0;
  std::string session = {};  // as the log calls it
};

inline constexpr std::size_t kMostAliases = 3;  // of an effect, that are listed

// An effect that the data show, in the order in which they were found.
struct NamedEffect {
  std::string name;
  std::vector<std::string> aliases;  // effects that these data cannot distinguish from it
  std::string alias_reason;          // one sentence; empty without aliases
  double confidence = 0;             // that it, or one of its aliases, is there, [0, 1]
  std::vector<Estimate> parameters;
  // Mean log score lost against the floor, nats a trial, on trials that the fit did not see.
  double gap_before = 0;
  double gap_after = 0;
  // The same trials' root mean squares before and once the effect was added; empty when not
  // measured.
  std::optional<double> position_mm_before, heading_mrad_before;
  std::optional<double> position_mm_after, heading_mrad_after;
  double closed = 0;  // share of the explainable gap (tuned minus floor) that adding it removed
  double closed_lo = 0;
  double closed_hi = 0;
  std::string text;  // one sentence for a person
  std::string axis;  // "x" or "y": of camera_seam, which coordinate crosses the line
  std::vector<SessionGain> sessions = {};  // of session_gain, in the log's order
};

struct GapFigures {
  double tuned = 0;
  double final_ = 0;
  double floor = 0;
};

// A dependence of the tuned model's residuals.
struct Where {
  std::string command;    // "all" when it shows in every command alike
  std::string component;  // "x", "y", "theta"
  std::string kind;       // "bias", "spread", "trend", "outliers"
  std::string covariate;  // "time", "start heading", ...; empty for a plain bias or spread
  double size = 0;        // mm, or mrad for theta
  double share = 0;       // of the explainable gap
  double p = 1;           // corrected for all the looks
  std::string text;       // one plain sentence
};

struct Screened {
  std::string effect;
  double gain = 0;       // log-likelihood gained by the best strength, nats over all trials
  double p = 1;          // against the null distribution of this effect's own gain
  std::string estimate;  // "rate 0.0035 1/min": the parameters at that gain
  std::vector<std::string> alias_set;  // effects whose remaining signatures are parallel
  std::string note;  // why it cannot be seen in these data, or what it is an alias of
  // By parameter, how far from neutral it is named with 95 % power on this log, by slopes at the
  // fit, each alone; empty: not known.
  std::vector<std::pair<std::string, double>> detectable_from = {};
};

// A dependence of what is left once everything that was found is explained.
struct Leftover {
  std::string covariate;
  double log10_p = 0;
  double excess = 0;  // nats over all trials beyond what chance explains
};

// One step of the selection: net gain (nats) of the best effects, given what is explained.
struct SelectionRecord {
  std::vector<std::string> explained;  // effects named so far
  std::vector<std::pair<std::string, double>> offered;
};

// A smooth correction of what is left when nothing of the catalogue explains it; nobody's cause.
struct FoundResidual {
  Residual correction;  // places are the world's; empty: none helps significantly
  // On trials that neither its choice nor its fit saw, nats a trial, with a 90 % interval.
  double gained = 0, gained_lo = 0, gained_hi = 0;
  double gap_before = 0, gap_after = 0;             // mean log score lost against the floor
  double closed = 0, closed_lo = 0, closed_hi = 0;  // share of the explainable gap
  std::string text;                                 // a sentence for a person
  std::vector<double> chances;                      // of every trial to be an outlier
};

// What of the catalogue comes nearest where it explains too little.
struct NearMiss {
  std::vector<std::string> effects;  // one, or several together
  double gain = 0;                   // nats over all trials that they explain
  double left = 0;                   // nats that they leave of a dependence on ...
  std::string left_on;               // ... this
  std::string text;                  // why they are not named
};

struct NextExperiment {
  std::string text;
  std::vector<std::string> separates;
  std::uint64_t trials = 0;  // needed to distinguish them with 95 % power
};

// How the pictures describe trials; empty: of commands that were driven.
struct PictureLabels {
  std::string ends;       // a paragraph on the pictures of end poses
  std::string residuals;  // same of residuals
  std::string x, y;       // "along the push": components of a residual
};

// What the pictures may show residuals against, beside what every log has.
struct ShownCovariate {
  std::string key;      // of its column
  std::string label;    // "distance pushed, mm"
  std::string matches;  // what Where::covariate holds when a finding is of it
};

// One trial for the plots.  Ends are seen from the measured start.
struct DiagnosedTrial {
  std::string session;
  std::int64_t trial = 0;
  std::string command;
  double session_time_s = 0;
  double duration_s = 0;
  double level = 0;  // greater of the two sides' duties
  int place_in_run = 0;
  bool held_out = false;
  Pose X_WS;
  Pose measured, tuned, final_;  // X_SE
  // m, m, rad, in the predicted end's own axes.
  Eigen::Matrix3d tuned_cov = Eigen::Matrix3d::Zero(), final_cov = tuned_cov;
  Eigen::Vector3d tuned_residual = Eigen::Vector3d::Zero(), final_residual = tuned_residual;
  double tuned_score = 0, final_score = 0;  // nats
  std::vector<double> covariates;           // one a Diagnosis::shown
};

// One real drive beside the simulated ones, from its measured start.  A path that is not known is
// empty.
struct ShownDrive {
  std::size_t trial = 0;  // index into Diagnosis::trials
  std::string why;        // "worst of forward"
  std::vector<PathSample> measured, tuned, final_;
};

struct Diagnosis {
  Verdict verdict = Verdict::kNone;
  std::string headline;               // the cause on one line, in plain language
  std::string action;                 // what to do about it, on one line
  std::vector<std::string> findings;  // the same at length, a sentence each
  std::vector<NamedEffect> effects;
  GapFigures gap;          // nats/trial
  GapFigures position_mm;  // root mean square
  GapFigures heading_mrad;
  // Of an unusable log: why; what names an effect also stands in `effects`.  Notes of any log.
  std::vector<SanityFinding> sanity;
  std::vector<Where> where;        // of the tuned base model
  std::vector<Where> unexplained;  // of the final model
  std::vector<Screened> screening;
  std::vector<SelectionRecord> steps;
  std::vector<Leftover> checks;           // most significant first
  std::optional<FoundResidual> residual;  // where something is unexplained
  std::vector<NearMiss> nearest;          // nearest first
  std::vector<NextExperiment> next;
  std::vector<std::string> cautions;               // thin data and the like, one sentence each
  std::vector<ParameterRow> parameters;            // what was tuned, and of the named effects
  std::vector<ParameterCorrelation> correlations;  // of the last fit, strongest first
  std::vector<ShownDrive> drives;
  std::vector<DiagnosedTrial> trials;
  std::vector<ShownCovariate> shown;
  PictureLabels labels;
  // Label and value: files, hashes, counts, program, seeds, the run stores behind the numbers.
  std::vector<std::pair<std::string, std::string>> provenance;
  std::vector<std::pair<std::string, double>> timing_s;  // stage and wall seconds
};

}  // namespace gapfarm
