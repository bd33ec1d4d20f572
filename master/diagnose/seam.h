// A second camera's share of the floor: what it does to readings, and where it begins.
#pragma once

#include <Eigen/Core>

#include "master/diagnose/regression.h"
#include "master/diagnose/signatures.h"

namespace gapfarm {

constexpr double kSeamStep_m = 0.005;  // to which a seam's position is searched

// Shift of the readings beyond a line: two offsets, then two slopes along it about `middle`.
Signature seam_signature(const Study& study, int axis, double position_m);

// Where the line of a seam with these coefficients of seam_signature()'s columns runs, m.  Readings
// lie beyond the line shifted, so which side a pose was seen from follows from the shift, too; the
// signature, which knows of none, leaves a line anywhere between the two.
double seam_position(const Study& study, const Regression& others, const Signature& seam,
                     const Eigen::Vector4d& coefficients);

}  // namespace gapfarm
