// How large the chosen effects are, and how far the gap shrinks with them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/diagnose/fit/proposals.h"
#include "master/diagnose/fit/regression.h"
#include "master/infer/fit.h"

namespace gapfarm {

struct FittedParameter {
  std::size_t row = 0;
  double value = 0;
  double standard_error = 0;
  double bent = 1;  // by how much that is wider than slopes say (profile.h)
};

using infer::Loss;

struct JointFit {
  Overrides at;                             // base and effects
  std::vector<FittedParameter> parameters;  // the base's first
  std::size_t base_parameters = 0;
  std::vector<Eigen::Vector3d> residuals;  // in the fit's own predicted ends' axes
  std::vector<Pose> ends;
  Eigen::MatrixXd jacobian;  // whitened rows by parameters
  Loss loss = Loss::kHuber;
};

enum class BaseParameters { kHeld, kFitted };

// At most so many steps of infer::Fitter; fitted base parameters have their prior; `nuisances` (may
// have no columns) take part and are thrown away.  Errors: the farm's, and a start that cannot be
// simulated.
Result<JointFit> fit_jointly(Predictor& predictor, const Study& study,
                             const std::vector<EffectCandidate>& effects, const Overrides& start,
                             BaseParameters base, const Eigen::MatrixXd& nuisances, int rounds,
                             Loss loss = Loss::kHuber, infer::Sides sides = infer::Sides::kOne);

// As such: no columns.
Eigen::MatrixXd no_nuisances(const Study& study);

// Standard deviation of a fitted base parameter's prior, in its own unit.
double prior_sd(const Study& study, const BaseParameter& p);
// What trials that are learnt from, and that prior, say of the parameters beside the nuisances.
Eigen::MatrixXd information_of(const Study& study, const JointFit& fit,
                               const Eigen::MatrixXd& nuisances);

// The same as the competition sees it: `nuisances` are the first coordinates, the fit's parameters
// the others.
infer::Observations observations_of(const Study& study, const Eigen::MatrixXd& nuisances,
                                    Loss loss);
infer::Space space_of(const Study& study, const JointFit& fit, Eigen::Index nuisances);
// With the fit's slopes, by the study's noise.
infer::Fit as_searched(const Study& study, const JointFit& fit, const infer::Fitter& fitter,
                       const infer::Space& space);

// Twice the nats that a fit's residuals cost once the nuisances have taken their part.
double misfit_of(const Study& study, const JointFit& fit, const Eigen::MatrixXd& nuisances);

// Where the seams of a fit run, searched with everything else held: the derivatives of a fit know
// of no line.  Whether any moved; residuals and derivatives are then those of before.
Result<bool> move_seams(Predictor& predictor, const Study& study, const Eigen::MatrixXd& nuisances,
                        JointFit* fit);

// Parameter values at which a refinement of the effect begins: those of so many times what the
// signature's columns take.
std::map<std::string, double> start_values(const Study& study, const Regression& others,
                                           const Signature& signature, double times = 1);

// The same where the columns' coefficients are these.
std::map<std::string, double> values_at(const Study& study, const Regression& others,
                                        const Signature& signature,
                                        const Eigen::VectorXd& coefficients);

// Log scores (nats) of every trial that misses its prediction so far.
std::vector<double> scores_of(const Study& study, const std::vector<Eigen::Vector3d>& residuals,
                              double outlier_share);

// Residuals of every trial, predicted from a fit to the other folds' trials alone: the joint fit's
// linearisation is solved again without the fold.
std::vector<Eigen::Vector3d> held_out_residuals(const Study& study, const JointFit& fit,
                                                const std::vector<std::size_t>& fold_of);

// Of every trial, seen or not, under the one that did not see fold `f`.
std::vector<Eigen::Vector3d> left_without(const Study& study, const JointFit& fit,
                                          const std::vector<std::size_t>& fold_of, std::size_t f);

// Sessions when there are several, else five contiguous blocks.
std::vector<std::size_t> folds_of(const Study& study);

// What a trial scores on average when its prediction is perfect and its noise is as estimated.
double floor_score(const Study& study, double outlier_share);

}  // namespace gapfarm
