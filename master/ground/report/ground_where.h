// Where what is left of a ground robot's gap shows.
#pragma once

#include <string>
#include <vector>

#include "master/diagnose/result/diagnosis.h"
#include "master/ground/search.h"

namespace gapfarm {

// One finding a component that holds a quarter of what could still be closed or more, largest
// first: at which horizon it is largest, and from when on in the log, where one half holds it.
std::vector<Where> where_left(const WindowFitter& fitter, const GroundSearch& search,
                              const std::vector<double>& horizons_s);

// Values that would move most, each more than two of its tolerances, were all of them free; empty:
// none.  "separation by -3.1 %, lag by +0.05 s".
std::string values_that_would_move(const GroundSearch& search);

}  // namespace gapfarm
