// How much values differ from one stretch of driving to the next, beyond how sure they are on the
// whole: what a robot makes of commands that its kinematics have no word for.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "master/ground/fit/window_fit.h"

namespace gapfarm {

// What no value explains of windows of one length: standard deviations along and across the end's
// heading, m, and of it, rad.
struct WindowScatter {
  double window_s = 0;
  Eigen::Vector3d sd;
};

struct Variation {
  Eigen::VectorXd shift;       // of the values' mean over windows, from the fit's
  Eigen::MatrixXd covariance;  // of the values from window to window
  std::vector<WindowScatter> scatter;
};

// The likeliest of values that are drawn anew for each window and of Gaussian errors of its end, by
// expectation maximisation (Laird and Ware 1982), begun at a covariance of the values.  Where there
// are two runs or more, both are as much wider as windows of runs that are held out in turn ask
// for.
Variation variation_of(const std::vector<EndedWindow>& windows, const Eigen::MatrixXd& begin);

}  // namespace gapfarm
