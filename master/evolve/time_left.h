// How long a run will still take.
#pragma once

#include <cstdint>
#include <optional>

#include "common/config/settings.h"

namespace gapfarm {

// What a run did, in all and since its present master started.
struct Pace {
  std::uint64_t generation = 0;   // committed, of the run
  std::uint64_t evaluations = 0;  // of the run, with those of the generation in work
  double wall_s = 0;              // of the run
  double share = 0;               // of the generation in work that is done, [0, 1]
  std::uint64_t generations_here = 0;
  std::uint64_t evaluations_here = 0;
  double wall_here_s = 0;
};

// Until the first of the stop conditions that can be foreseen (generations, evaluations, time), at
// the mean pace of the present master.  None while there is nothing to go by.
std::optional<double> time_left_s(const EvolutionSettings& settings, const Pace& pace);

}  // namespace gapfarm
