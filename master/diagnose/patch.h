// Discs of floor or table with another friction, and how they are looked for.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "common/base/result.h"
#include "master/diagnose/regression.h"

namespace gapfarm {

// x, y, radius (m), ratio of the friction inside to that outside.
using Patch = std::array<double, 4>;

// Up to `most` discs that promise to explain `least` squares or more beyond `explained`, the best
// first, none near another.
using PatchSearch = std::function<Result<std::vector<Patch>>(const Regression& explained,
                                                             std::size_t most, double least)>;

}  // namespace gapfarm
