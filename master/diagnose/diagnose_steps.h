// The steps of diagnose(), each on what the ones before left in the run.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "master/diagnose/covariates.h"
#include "master/diagnose/diagnose.h"
#include "master/diagnose/distribution.h"
#include "master/diagnose/estimate.h"
#include "master/diagnose/latency.h"
#include "master/diagnose/path_lag.h"
#include "master/diagnose/prepare.h"
#include "master/diagnose/selection.h"
#include "master/diagnose/slip.h"
#include "master/diagnose/spread_row.h"
#include "master/diagnose/study.h"
#include "master/diagnose/subject.h"
#include "master/diagnose/verdict.h"

namespace gapfarm {

// By paired scores: not by chance, but for one case in twenty.
bool clearly_better(const std::vector<double>& scores, const std::vector<double>& others);

inline constexpr int kMostRounds = 6;  // of a fit that does not settle; most need two

class DiagnosisRun {
 public:
  // REQUIRES: a scenario that has a diagnosis_subject().
  // All three outlive it.
  DiagnosisRun(Farm& farm, const PreparedLog& log, const DiagnoseOptions& options)
      : problem_(log.problem),
        keeps_subject_(diagnosis_subject(log.problem)),
        subject_(*keeps_subject_),
        options_(options),
        farm_(farm),
        frame_m_(log.frame_x_m, log.frame_y_m),
        predictor_(farm, log.problem) {
    result_.diagnosis.sanity = log.sanity;
    result_.problem = predictor_.problem_hash();
    result_.frame_x_m = log.frame_x_m;
    result_.frame_y_m = log.frame_y_m;
  }

  // Ends the stage before, if any, and begins one; "" only ends.
  void stage(const std::string& name);

  Status tune();
  Status measure_noise();
  Status screen();
  Status judge();
  Status refit();
  Status report();
  // Tells who watches what step `k` of kDiagnosisStages found; changes nothing.
  void tell_of_stage(std::size_t k) const;
  DiagnosisResult take() { return std::move(result_); }
  // Whether a stage's error is a simulation's, which is no reason to be without a report.
  DiagnosisResult give_up(const std::string& stage, const Error& error);

 private:
  // What tell_of_stage() is made of, and what can be told within a stage (diagnose_so_far.cc).
  bool watched() const { return options_.on_finding != nullptr; }
  void tell_of_base() const;
  void tell_of_noise() const;
  void tell_of_readings() const;
  void tell_of_candidates(const std::vector<EffectCandidate>& candidates) const;
  void tell_of_fit(const JointFit& fit) const;
  void tell_of_choice() const;
  void tell_of_verdict() const;
  void tell_of_gaps() const;
  SanityFinding on_bounds() const;
  Status free_base();
  bool explains_bounds() const;
  Status doubt_base();
  void doubt(SanityFinding finding);
  void doubt_misses();
  // `perfect`: what a prediction scores that misses nothing, once that is known.
  std::optional<std::pair<std::size_t, std::string>> effect_to_drop(
      std::optional<double> perfect) const;
  std::optional<std::pair<std::size_t, std::string>> effect_at_bound() const;
  void drop_effect(std::size_t k, const std::string& why);
  void say_what_was_left_out();
  // Of a table key that is a place along a world axis: how far the log's frame lies along it.
  double frame_of(const std::string& key, const Overrides& at) const;
  Status fit_final();
  double within_table(std::size_t row, double value);
  Status name_none(const std::vector<std::size_t>& folds);
  void complete_screening();
  std::string why_not_screened(const std::string& name, Screened* row) const;
  double pose_grid_gain() const;
  // As asked, or because the scenario's table has no such effect.
  bool left_out(const std::string& effect) const;
  // Whether there are poses on the way to be had: some programs answer where a drive ends alone.
  bool has_paths() const;
  void say_what_the_program_lacks();
  bool looks_for(const std::string& effect, Looks look) const;
  void compare_with_repeats();
  Status search_catalogue();
  Status look_for_all();
  Status search_again();
  Status rebuild_nuisances();
  Status look_for_latency();
  Result<std::vector<Eigen::Vector3d>> end_velocities();
  Status put_late_readings_right(std::vector<Eigen::Vector3d> velocity);
  Status date_latency(const std::vector<Eigen::Vector3d>& velocity);
  void name_nothing();
  Status look_for_lag();
  void fill_screening(const std::vector<EffectCandidate>& candidates);
  Regression explained() const;  // what is left once all that was chosen is explained
  double explained_nats(const Regression& explained) const;
  void look_for_slip(const Regression& explained);
  void look_for_spreads(const Regression& explained);
  Status look_for_spreads_again();
  void drop_ignored();
  std::vector<bool> tells_of_slips() const;
  Status select();
  Result<JointFit> estimate(const std::vector<EffectCandidate>& effects, int rounds);
  Result<Relinearised> relinearise(const std::vector<EffectCandidate>& effects);
  Status select_without_slips(const Regression& explained);
  // Base and these effects at their best linear fit.
  Overrides start_of(const std::vector<EffectCandidate>& effects) const;
  void set_noise(const NoiseEstimate& noise, Overrides* at) const;
  double mean_loss_of_slips() const;
  void spread_effects(Overrides* at) const;
  Status refit_nested();
  void foresee_slips(const std::vector<std::size_t>& folds);
  void drop_slips();
  void doubt_strays(const std::string& effect);
  void foresee_spreads(const std::vector<std::size_t>& folds);
  std::optional<double> fit_tails();
  Status fit_correction();
  Status fit_residual();
  // A smooth correction beside one of the nested fits, with scores on trials that it did not see.
  struct TriedResidual {
    std::size_t nested = 0;
    ResidualField field;  // empty: none helps
    std::vector<double> without, with;
    NoiseEstimate noise;  // of predictions beside it
  };
  TriedResidual try_residual(std::size_t k) const;
  void drop_correction();
  void note_nearest(const Regression& explained);
  NearMiss near_miss(std::vector<std::string> effects, double gain,
                     const std::vector<Leftover>& left) const;
  Status compare_with_baselines();
  Study study_beside(const JointFit& fit) const;
  void keep_nested(JointFit fit, const Study& fitted_in, Study scored_in);
  void score_nested(const std::vector<std::size_t>& folds);
  void judge_leftovers(const Regression& explained);
  void judge_again();
  void set_floor(const std::vector<std::size_t>& folds);
  Status estimate_beside_base();
  void name_effects();
  // An effect on the spread: gain in nats over all trials.
  struct SpreadEffect {
    std::string name;
    double gain = 0;
    std::vector<Estimate> estimates;
    std::vector<double> gained;  // of each trial, where that is known
  };
  std::vector<SpreadEffect> spread_effects_found() const;
  std::vector<double> gained_by(std::size_t nested) const;
  // Without words, and with a gap that only its change counts of.
  NamedEffect named(std::size_t k, const JointFit& estimates) const;
  NamedEffect named(const SpreadEffect& found) const;
  void set_closed(NamedEffect* effect, const std::vector<double>& gained) const;
  Status look_for_second_places();
  Status plan_next();
  void fill_gap();
  void fill_trials();
  void fill_values();
  void fill_parameters();
  std::vector<v1::Override> without_chance(ParameterValues values) const;
  Status show_drives();

  const Problem& problem_;
  std::shared_ptr<const DiagnosisSubject> keeps_subject_;
  const DiagnosisSubject& subject_;
  const DiagnoseOptions& options_;
  Farm& farm_;
  Eigen::Vector2d frame_m_;  // the log's frame in the world
  Predictor predictor_;
  Study study_;
  std::optional<Study> as_logged_;  // where late readings were put right: before that
  std::optional<Study> tuned_;      // where tuning ended on bounds: before anything was looked for
  Overrides tuned_alone_;           // the base without any effect, where study_.base is not it
  Eigen::MatrixXd nuisances_;
  std::vector<CovariateBlock> blocks_;
  std::unique_ptr<Regression> base_;  // nuisances only
  std::unique_ptr<Selector> selector_;
  LatencyFit latency_;
  double latency_from_rest_s_ = 0;  // as the parameter has it
  PathLag lag_;                     // by paths
  SlipFit slip_;
  std::vector<FoundSpread> spreads_;  // what else makes trials stray
  std::string odd_readings_;          // what readings show that no effect looked for explains
  std::string odd_drives_;            // the same of drives that stray in one place
  std::vector<Signature> first_;      // explained before anything else
  std::vector<ChosenEffect> chosen_;
  std::vector<Leftover> leftovers_;
  std::vector<JointFit> nested_;                    // see refit_nested()
  std::vector<Study> nested_studies_;               // each with the noise that the fit leaves
  std::optional<JointFit> estimates_;               // base held, beside nuisances
  std::vector<std::vector<double>> nested_scores_;  // held out, one a trial
  std::vector<double> slip_scores_;                 // the same, of the last fit and slips
  // What explains something, but too little of what is there to be named: as a correction it may
  // still help.
  std::vector<ChosenEffect> unnamed_;
  std::string correction_;                   // what is said of that; empty: there is none
  std::vector<EffectCandidate> candidates_;  // of the last search, before anything was chosen
  double scale_ = 1;                         // leftover variance over the noise's
  double floor_ = 0;
  bool doubted_ = false;                         // nothing is to be named
  std::optional<SanityFinding> misses_;          // why, where that shows after the refit
  std::optional<JointFit> final_fit_;            // base and effects as they are told
  std::optional<NoiseEstimate> residual_noise_;  // of predictions beside a correction
  DiagnosisResult result_;
  std::string stage_;
  std::chrono::steady_clock::time_point began_;
};

}  // namespace gapfarm
