// Discs of floor or table with another friction, and how they are looked for.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "master/diagnose/fit/regression.h"
#include "master/infer/settings.h"

namespace gapfarm {

// x, y, radius (m), ratio of the friction inside to that outside.
using Patch = std::array<double, 4>;

// Whether two discs lie far enough apart to be two: beside one whose place, size or ratio is a
// little wrong a second on its rim explains something.
inline bool are_two_patches(const Patch& a, const Patch& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1]) >= kPatchesApart * (a[2] + b[2]);
}

// What is looked for: discs that promise to explain `least` squares or more, `most` of them, each
// another one than `beside`.
struct PatchWish {
  std::size_t most;
  double least;
  std::optional<Patch> beside = {};
};

// The discs that explain most beyond what is explained, the best first, none near another.
using PatchSearch =
    std::function<Result<std::vector<Patch>>(const Regression& explained, const PatchWish& wish)>;

}  // namespace gapfarm
