// A ground robot's diagnosis in the words of its owner's files.
#pragma once

#include <string>

#include "master/diagnose/result/diagnosis.h"
#include "master/ground/search.h"

namespace gapfarm {

// What a value that was named is in the diagnosis: a fit's value and interval, beside the row's
// nominal.
Estimate estimate_of(const KinematicRow& row, double value, double lo, double hi);

// "The distance between the sides, as they roll, is off: wheel_separation 0.52 [...] m; the file
// has 0.5", a full sentence.
std::string text_of_value(const GroundRobot& robot, const GroundHypothesis& h,
                          const NamedEffect& effect);

// "Friction across the wheels fell by 38 % [33, 43], from 0.71 to 0.44", without a full stop.
std::string text_of_change(const GroundRobot& robot, const GroundHypothesis& h,
                           const NamedEffect& effect);

}  // namespace gapfarm
