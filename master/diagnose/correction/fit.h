// A smooth correction of drives' ends, by Gaussian-process regression of what a model leaves.
//
// Terms are taken one after the other while trials of folds that the fit did not see are clearly
// better predicted so; which covariates, which frame, which length scale and which strength is
// decided by these scores, too.  What the whole procedure is worth is measured by doing all of it
// again without each fold, and predicting that fold's trials.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "common/residual/field.h"

namespace gapfarm {

struct ResidualData {
  std::vector<LoggedMotion> facts;         // one a trial, as are all of these
  std::vector<Pose> ends;                  // predicted, world frame
  std::vector<Eigen::Matrix3d> whiteners;  // L^-1 of the trial's covariance L L'
  std::vector<std::size_t> fold;           // sessions or blocks, from 0
  std::vector<bool> learn;                 // whether a fit may learn from the trial
  bool free_commands = false;              // hardly a command repeats

  std::size_t size() const { return facts.size(); }
  std::size_t folds() const;
};

// Residuals (measured minus predicted end in the predicted end's axes: m, m, rad), one a trial.
using Residuals = std::vector<Eigen::Vector3d>;

struct ResidualFit {
  ResidualField field;  // may be empty: nothing helps
  // What of each trial the fit to the other folds foresaw.
  Residuals unseen;
};

// By paired scores: a mean gain that is not by chance, but for one case in twenty.
bool gains_significantly(const std::vector<double>& gains);

// Chosen and fitted by the trials that are `seen`.
ResidualField fit_field(const ResidualData& data, const Residuals& residuals,
                        const std::vector<bool>& seen);

// The field by all trials' `residuals`; and trials foreseen by the same procedure without their
// fold, from residuals of a model that was fitted without it, too: `without(fold)`.
ResidualFit fit_residual(const ResidualData& data, const Residuals& residuals,
                         const std::function<Residuals(std::size_t fold)>& without);

// Where readings jump: a line along x or y beyond which all of them are shifted alike, as two
// cameras' pictures do where they meet, or a floor that has a threshold.

// Nats of a whitened residual but for a constant: a trial in fifty may lie five times as far off as
// the noise.
double outlier_nats(const Eigen::Vector3d& whitened);

// The value of the covariate (of readings) that one shift of all readings beyond it explains most
// with, of the `residuals` of the trials that are `seen`; nothing where none explains anything.
std::optional<double> best_edge(const ResidualData& data, const Residuals& residuals,
                                const std::vector<bool>& seen, std::size_t covariate);

}  // namespace gapfarm
