// A second camera's share of the floor: what it does to readings, and where it begins.
#pragma once

#include <Eigen/Core>

#include "master/diagnose/fit/regression.h"
#include "master/diagnose/fit/signatures.h"

namespace gapfarm {

inline constexpr double kSeamStep_m = 0.005;       // to which a seam's position is searched
inline constexpr double kFineSeamStep_m = 0.0025;  // the same of one that was chosen

// Whether it is a seam, the first or a second one.
bool is_seam(const std::string& effect);
// "camera_seam.position" or that of a second one.
bool is_seam_position(const std::string& key);

// Shift of the readings beyond a line: two offsets, then two slopes along it about `middle`.
Signature seam_signature(const Study& study, int axis, double position_m);
// All positions scaled, sheared and turned as a whole, about any place; headings as they are.  No
// effect of the catalogue: where it does as well, no line on the floor is to be seen.
Signature linear_view_signature(const Study& study);
// The same as another effect of its kind: a second seam's.
Signature renamed(Signature signature, const std::string& effect);

// Whether two seams run far enough apart, or across one another, to be two.
bool are_two_seams(const Signature& a, const Signature& b);

// Where the line of a seam with these coefficients of seam_signature()'s columns runs, m.  Readings
// lie beyond the line shifted, so which side a pose was seen from follows from the shift, too; the
// signature, which knows of none, leaves a line anywhere between the two.
double seam_position(const Study& study, const Regression& others, const Signature& seam,
                     const Eigen::Vector4d& coefficients);

}  // namespace gapfarm
