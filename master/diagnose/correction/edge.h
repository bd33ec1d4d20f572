// Where readings jump: a line along x or y beyond which all of them are shifted alike, as two
// cameras' pictures do where they meet, or a floor that has a threshold.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "master/diagnose/correction/fit.h"

namespace gapfarm {

// Nats of a whitened residual but for a constant: a trial in fifty may lie five times as far off as
// the noise.
double outlier_nats(const Eigen::Vector3d& whitened);

// The value of the covariate (of readings) that one shift of all readings beyond it explains most
// with, of the `residuals` of the trials that are `seen`; nothing where none explains anything.
std::optional<double> best_edge(const ResidualData& data, const Residuals& residuals,
                                const std::vector<bool>& seen, std::size_t covariate);

}  // namespace gapfarm
