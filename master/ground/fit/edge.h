// The edge between two floors, as a hypothesis of a ground robot's diagnosis: beyond a line a wheel
// travels less far, or farther (common/score/kinematic.h).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "master/ground/fit/window_fit.h"
#include "master/ground/hypotheses.h"

namespace gapfarm {

inline constexpr const char* kFloorEdge = "floor_edge";

GroundHypothesis floor_edge();

// Values with the best of the lines that part the windows, at every angle.  `rows` hold those of
// floor_edge() behind those of `fit`.
Eigen::VectorXd scan_floor_edge(const WindowFitter& fitter, const WindowFit& fit,
                                const std::vector<FitRow>& rows, const Eigen::VectorXd& values);

// Nats that a fit with a hypothesis gains over one without, its price paid.  An edge gains nothing
// where all windows lie on one side, which is another floor; and no more than it does where every
// run has a share of its travel of its own, too: of runs that last as long, those that get beyond a
// line are the fast ones.
double gain_of(const WindowFitter& fitter, const GroundHypothesis& hypothesis,
               const WindowFit& with, const WindowFit& without);

}  // namespace gapfarm
