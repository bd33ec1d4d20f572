// Kinds of drives, which some effects strike in ways of their own.
#pragma once

#include "master/diagnose/study.h"

namespace gapfarm {

// Whether a drive sticks: Coulomb treads then give way to no small force, real ones creep in
// proportion to it.
inline bool is_straight(const Study& study, std::size_t trial) {
  return study.cells[study.trials[trial].cell].kind == MotionKind::kStraight;
}

}  // namespace gapfarm
