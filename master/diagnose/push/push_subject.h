// What a diagnosis has to know of pushed pieces (docs/pushing.md).
//
// Every push is a condition of its own: piece, start and the finger's way.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "master/diagnose/subject.h"

namespace gapfarm {

DiagnosisSubject push_subject();

// The row's functions; see DiagnosisSubject.

// The base is what of the config's genes is a shape factor or a friction, else shape factor and
// finger friction.  A shared shape factor becomes one a piece when the log has several.
// Errors: an empty log, more pieces than can have a shape factor of their own.
Result<Study> make_push_study(const Problem& problem, std::span<const Gene> genes);
// From the config's values, robust Gauss-Newton.
Status tune_push_base(Predictor& predictor, bool keep, Study* study);
// Start noise through the simulation, end noise, and the piece's own, which grows as it slides.
Eigen::Matrix3d push_covariance(const ResidualTrial& trial, const NoiseEstimate& noise);
// Retuning, the outline's tolerance, misfits that are alike for a push and its mirror image, and
// what repeats of one push have in common.
Result<Eigen::MatrixXd> push_nuisances(Predictor& predictor, Study& study);
std::vector<CovariateBlock> push_blocks(const Study& study);
// Whether the piece, on its way as the base predicts it, comes upon the disc.
bool piece_crosses(const ResidualTrial& trial, const Patch& patch);
// Discs of two sizes and two frictions over all that pieces slide across.
std::vector<infer::Start> push_patch_starts(const Study& study);
// Lenses that bend either way about the middle of all pushes.
std::vector<infer::Start> push_lens_starts(const Study& study);
// Whole cells, dealt in turn.
std::vector<std::size_t> push_folds(const Study& study);
std::vector<Where> push_where(const Study& study, std::span<const Eigen::Vector3d> residuals,
                              const Problem& problem);
std::vector<std::string> push_cautions(const Study& study, const TrialLog& log);
std::vector<std::string> push_lacks(const Study& study, const TrialLog& log);
TrialView push_view(const Study& study, std::size_t trial);

// A shift along and across the push (across: to its left), in the axes of the predicted end.
Eigen::Vector3d from_push_axes(const ResidualTrial& trial, const Eigen::Vector3d& shift);

}  // namespace gapfarm
