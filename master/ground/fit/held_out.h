// Predictions of stretches of a log that were not fitted, and how significantly one is better than
// another.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/base/ranges.h"
#include "master/diagnose/result/diagnosis.h"
#include "master/ground/fit/window_fit.h"

namespace gapfarm {

// Of every block, the fold that it is held out with.  What a run has of its own, such as its
// clock's offset, is held out together where there are runs enough.
std::vector<int> held_out_folds(const WindowSet& windows);

// The rows fitted to all but one of the folds, kFolds times; no rows: the file's values as they
// are.
std::vector<WindowFit> fit_without_folds(const WindowFitter& fitter,
                                         const std::vector<FitRow>& rows,
                                         const Eigen::VectorXd& start);
// Nats of every window by the one of these that was not fitted to it.
WindowFit fit_held_out(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                       const Eigen::VectorXd& start);

// A fit with these residuals in place of its own (m, m, rad), those of each fold under the scales
// of the others.
WindowFit judge_held_out(const WindowFitter& fitter, WindowFit fit,
                         const std::vector<Eigen::Vector3d>& raw);

// How often each block of a log counts, draw by draw.  Of n runs n are drawn, and of each as many
// blocks as it has; together they count as n.  `of_values`: so that the scatter of few is not taken
// for small, one run fewer is drawn, or of a single run kSparedStretches blocks fewer.
std::vector<std::vector<double>> draw_blocks(const WindowSet& windows, std::uint64_t seed,
                                             bool of_values);

// What nine in ten of some draws lie within.
Interval ninety_percent_of(std::vector<double> drawn);
// With the fit's own value: where the draws lead away from it, it has not settled, and is no surer
// than that.
Interval interval_about(double value, std::vector<double> drawn);

// What follows from a fit's values, with 90 % of the draws, no less wide than by what fits without
// one of the folds each scatter by (the jackknife): slopes where few windows lie, and forms that
// are right by some share only, make draws too sure.  A draw that is not `possible` (none stated:
// all are) is a step that led beyond where its slopes hold: what fits without a fold stands for it,
// but for the first of what follows, the size, which may be none.
std::vector<Estimate> derived_estimates(
    const WindowFitter& fitter, const WindowFit& fit, std::uint64_t seed,
    const std::function<std::vector<Estimate>(const Eigen::VectorXd& values)>& derive,
    const std::function<bool(const Eigen::VectorXd& values)>& possible = {});

// Nats a window, with a 90 % interval by runs and blocks drawn again.
struct HeldOutGain {
  double mean = 0;
  double lo = 0;
  double hi = 0;
};

HeldOutGain held_out_gain(const WindowSet& windows, const WindowFit& with, const WindowFit& without,
                          std::uint64_t seed);
// Share that `with` gains over `without` of what `best` gains over `worst`, within [0, 1].
HeldOutGain share_of_gap(const WindowSet& windows, const WindowFit& with, const WindowFit& without,
                         const WindowFit& best, const WindowFit& worst, std::uint64_t seed);

}  // namespace gapfarm
