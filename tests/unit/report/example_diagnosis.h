// A diagnosis as a tracked robot on a sagging battery and a lopsided floor would give.
#pragma once

#include "master/diagnose/result/diagnosis.h"

namespace gapfarm {

// Six commands, three durations and levels, three sessions, 540 trials; battery sag and a floor
// tilt named, a seam of the camera unexplained.  The same every time.
Diagnosis example_diagnosis();

// The same trials with nothing to find.
Diagnosis null_diagnosis();

}  // namespace gapfarm
