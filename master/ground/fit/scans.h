// Where to begin with values that slopes at the file's do not lead to.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "master/ground/fit/window_fit.h"

namespace gapfarm {

// The best of some values, each as it is with scales of its own; `most`: nats of the first, which
// are known.
Eigen::VectorXd best_held(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                          const Eigen::VectorXd& values, const std::vector<Eigen::VectorXd>& others,
                          std::optional<double> most = {});

// Values whose delay is the best of those within 10 s of where it stands: one that is far off is
// no slope away.
Eigen::VectorXd scan_delay(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                           const Eigen::VectorXd& values);

// Values whose grip is the best of those far and near: past the limit of a tyre no slope leads
// back.
Eigen::VectorXd scan_grip(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                          const Eigen::VectorXd& values);

// Values of which the last row is the best of what is plausible of it, its half, a quarter, ...
Eigen::VectorXd scan_size(const WindowFitter& fitter, const std::vector<FitRow>& rows,
                          const Eigen::VectorXd& values);

// Where wheels stand where windows begin, from the fitter's origin; `far_from`: where windows miss
// this fit by far, alone.
std::vector<Eigen::Vector2d> wheel_places(const WindowFitter& fitter,
                                          const WindowFit* far_from = nullptr);

// Root mean square of how far places lie from their middle.
double scatter_of(const std::vector<Eigen::Vector2d>& places);

// How far (s^2/m) a ramp has to be from this one, so that wheels reach the speeds that they are
// commanded to later or sooner by `by_s`, on average over how much these change: the same ramp is
// felt where a robot is driven hard.  Infinite: nothing that is commanded here shows it.
// REQUIRES: a complete robot without a throttle.
double ramp_that_shows(const GroundRobot& robot, const RunLog& log, double ramp, double by_s);

}  // namespace gapfarm
