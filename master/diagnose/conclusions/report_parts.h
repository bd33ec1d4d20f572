// What the report of a diagnosis is made of.
#pragma once

#include <string>
#include <vector>

#include "master/diagnose/steps/steps.h"

namespace gapfarm::steps {

// Share of the explainable gap, with an interval from a bootstrap over the chains between
// unrecorded moves, whose trials share a start.
struct ClosedShare {
  double share = 0, lo = 0, hi = 0;
};
// `gained`: nats of every trial.
ClosedShare closed_share(const DiagnosisRequest& of, const Refit& refit,
                         const std::vector<double>& gained);

// Greatest gain first; each one's gap goes on from the one before.
std::vector<NamedEffect> named_effects(const DiagnosisRequest& of, const Refit& refit);

struct RootMeanSquare {
  double position_mm = 0;
  double heading_mrad = 0;
};
RootMeanSquare root_mean_square(const std::vector<Eigen::Vector3d>& residuals);
// That chance alone makes.
RootMeanSquare error_of_noise(const Study& study);
// Of trials that no fit saw; of one that a fold's linear step would move far beyond the noise,
// under the fit to all.
RootMeanSquare held_out_error(const NestedFit& nested, const std::vector<std::size_t>& folds);

// Rows of every effect of the catalogue, also those that no mean shows.
std::vector<Screened> complete_screening(const DiagnosisRequest& of, const Screening& screening,
                                         const Judgement& judged);

// The values that models are left with; a model holds what the table accepts, and what a log asks
// beyond that is reported.
void fill_values(const DiagnosisRequest& of, const Refit& refit, DiagnosisResult* result);
// The noise's rows of the table.
void set_noise(const DiagnosisRequest& of, const NoiseEstimate& noise, Overrides* at);

std::vector<DiagnosedTrial> diagnosed_trials(const DiagnosisRequest& of, const Refit& refit);
void fill_parameters(const DiagnosisRequest& of, const Refit& refit, DiagnosisResult* result);
// Some drives once more from where they began, by both models.  One that does not end well is
// omitted: the picture can do without.
Result<std::vector<ShownDrive>> shown_drives(const DiagnosisRequest& of,
                                             const DiagnosisResult& result);

// One sentence of all that what is left depends on, the clearest first; none where there is none.
std::vector<std::string> leftover_caution(std::vector<Leftover> left);
// What could not be looked for, a sentence each.
std::vector<std::string> not_looked_for(const DiagnosisRequest& of);
// What was held out of the simulation, a sentence a reason.
std::vector<std::string> not_simulated(const DiagnosisRequest& of);

// What is known so far, as a report, where a step could not go on.
struct PartialResult {
  const Study* tuned = nullptr;  // null: not even measured
  const Screening* screening = nullptr;
  const Judgement* judged = nullptr;
};
DiagnosisResult fail_with_partial_report(const DiagnosisRequest& of, const PartialResult& known,
                                         const std::string& step, const Error& error);

}  // namespace gapfarm::steps
