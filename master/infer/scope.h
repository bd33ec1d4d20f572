// A part of the observations, and the simulation asked for these alone.
#pragma once

#include <cstdint>
#include <vector>

#include "master/infer/fit.h"

namespace gapfarm::infer {

struct Scope {
  Forward forward;
  Observations observations;
  std::vector<std::uint32_t> index;  // of each in the whole; ascending
};

// REQUIRES: `forward` outlives it.
Scope scope_of(const Forward& forward, const Observations& whole, std::vector<std::uint32_t> index);
// Those of the whole (ascending) that are in the scope, as it counts them.
std::vector<std::uint32_t> within(const Scope& scope, const std::vector<std::uint32_t>& some);

// The same, asking once for what was asked before: a fit of what no simulation moves stays where it
// is.
Forward remembering(Forward forward);

}  // namespace gapfarm::infer
