// The steps of diagnose(), and the values that they hand on.  None changes what it was given; each
// asks the simulation through the request alone.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/ranges.h"
#include "master/diagnose/conclusions/findings.h"
#include "master/diagnose/diagnose.h"
#include "master/diagnose/evidence/covariates.h"
#include "master/diagnose/evidence/latency.h"
#include "master/diagnose/evidence/session_gains.h"
#include "master/diagnose/fit/estimate.h"
#include "master/diagnose/fit/proposals.h"
#include "master/diagnose/study.h"
#include "master/diagnose/subject.h"
#include "master/infer/predictor.h"

namespace gapfarm::steps {

struct DiagnosisRequest {
  Farm& farm;
  Predictor& predictor;
  const Problem& problem;  // its log in its own frame
  const DiagnosisSubject& subject;
  const DiagnoseOptions& options;
  Eigen::Vector2d frame_m;  // of the log in the world

  const ParameterTable& table() const { return problem.table(); }
  double outlier_share() const { return problem.fitness.outlier_share; }
  // As asked, or because the scenario's table has no such effect.
  bool excluded(const std::string& effect) const;
  // Whether it has a row among the scenario's.
  bool knows(const std::string& effect) const { return subject.effects->find(effect) != nullptr; }
  // Whether poses on the way are known: some programs answer where a drive ends alone.
  bool has_paths() const;
  // Of a table key that is a place along a world axis: how far the log's frame lies along it.
  double frame_of(const std::string& key, const Overrides& at) const;
};

// A log beside the tuned base, whitened by its noise, with what no effect may claim.
struct Evidence {
  Study study;
  Eigen::MatrixXd nuisances;  // rows of ignored trials are 0, here and below
  std::vector<CovariateBlock> blocks;
  Regression base;  // the nuisances alone
};

// The evidence as it is read now, and what explains it so far.
struct Explanation {
  std::shared_ptr<const Evidence> evidence;
  // What is strong may have drawn the base to its bounds: beside it the base is fitted once more,
  // and all is looked for again from there.
  bool frees_base = false;
  Overrides tuned_alone;  // the base without any effect, where the study's is not it

  LatencyFit latency;              // also where too little speaks for it
  double latency_from_rest_s = 0;  // as the parameter has it
  std::vector<Signature> first;    // explained before anything else: late readings
  std::optional<Study> as_logged;  // where they were put right: the study before that
  PathLag lag;
  // What is named of readings, single trials and sessions.
  std::vector<FoundSpread> spreads;
  std::vector<EffectCandidate> chosen;
  std::optional<JointFit> estimates;  // of these, base held, beside nuisances

  std::vector<std::size_t> lone;  // trials that are like no other: omitted
  std::string odd_readings;       // what readings show that no effect looked for explains
  std::string odd_drives;         // the same of outlier drives in one place

  const Study& study() const { return evidence->study; }
  bool chose(const std::string& effect) const {
    return contains(chosen, effect, &EffectCandidate::effect);
  }
  bool names_session_gains() const { return study().session_spread > 0; }
  const FoundSpread* spread(const std::string& effect) const {
    return find_by(spreads, effect, &FoundSpread::effect);
  }
  bool names_outliers() const {
    return std::ranges::any_of(
        spreads, [](const FoundSpread& s) { return s.row != nullptr && !s.row->by_session; });
  }
  bool names_anything() const { return !chosen.empty() || !spreads.empty(); }
};

// Of each effect: Screened::detectable_from.
using Sizes = std::vector<std::pair<std::string, double>>;
using DetectableSizes = std::map<std::string, Sizes>;

struct Screening {
  Explanation found;
  std::vector<Screened> rows;            // of the table
  std::vector<EffectCandidate> alone;    // of every effect, before anything was chosen
  std::unique_ptr<Proposals> catalogue;  // refers to the evidence
  std::vector<SelectionRecord> steps;
  std::optional<SanityFinding> warning;  // why nothing is to be looked for
  std::optional<double> explained;       // nats, held out, where hypotheses competed
  std::vector<NearMiss> refused;         // at their bounds
  DetectableSizes detectable = {};
};

// What is to be believed of that.
struct Judgement {
  Explanation named;
  Verdict verdict = Verdict::kNone;
  std::vector<Leftover> left;
  double scale = 1;  // leftover variance over the noise's
  // What explains something, but too little of what is there to be named: as a correction it may
  // still help.
  std::vector<EffectCandidate> unnamed;
  std::vector<NearMiss> nearest;
  std::vector<std::string> cautions;
  std::vector<SanityFinding> warnings;  // with any, nothing is to be named
  bool base_is_suspicious = false;      // as if nothing had been looked for
};

// A model fitted without nuisances, since this is what a user's predictions will come from.
struct NestedFit {
  std::string name;             // "the tuned base, floor_tilt and backlash"
  std::vector<v1::Task> tasks;  // that predicted it
  JointFit fit;
  Study study;                 // with the noise that the fit leaves
  std::vector<double> scores;  // held out, one a trial
};

struct Refit {
  Judgement judged;
  // Base alone; with late readings put right, where there are any; with the first effect, with the
  // first two, ...; with a correction by effects that are not named.
  std::vector<NestedFit> nested;
  double floor = 0;                    // what a perfect prediction would score
  std::string correction;              // what is reported of that; empty: there is none
  std::optional<JointFit> final_fit;   // base and effects as they are reported
  std::optional<FoundResidual> shape;  // a smooth correction of what is unexplained
  Residual residual;                   // the same in the log's frame; empty: none helps
  std::optional<NoiseEstimate> noise;  // of predictions beside it
};

// A base that fits the log, or the problem's own.
Result<Study> tune(const DiagnosisRequest& of);

// The noise that no smooth function explains, and the log by it.
Result<Evidence> measure(const DiagnosisRequest& of, const Study& tuned);

// All that the catalogue offers, and what of it the log calls for.
Result<Screening> screen(const DiagnosisRequest& of, const Evidence& measured);

// Whether that explains enough to be named.
Result<Judgement> judge(const DiagnosisRequest& of, const Screening& screening);

// What is named, fitted with the base and scored on trials that no fit saw; what proves worthless
// is dropped.
Result<Refit> refit(const DiagnosisRequest& of, const Evidence& measured,
                    const Screening& screening, const Judgement& judgement);

// Where something is unexplained: a smooth correction of it, if one helps significantly.
Refit add_shape(const DiagnosisRequest& of, const Refit& refit);

// Figures, words, values and what to drive next.
Result<DiagnosisResult> report(const DiagnosisRequest& of, const Screening& screening,
                               const Refit& refit);

}  // namespace gapfarm::steps
