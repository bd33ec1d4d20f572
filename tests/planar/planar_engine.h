// A tracked robot in the plane.  Under each tread lie strips of soil; the grip of a strip grows
// with the slip that it has seen since it came under the tread (Janosi and Hanamoto 1961; Wong,
// Theory of Ground Vehicles) up to Coulomb's, on an ellipse of friction along and across.  The load
// on every strip follows the place of the mass, its accelerations and the slope.
//
// Each step solves for the velocities after it with the strips' grip over slip as it is before
// (linearly implicit), which rests without chattering.
#pragma once

#include "tests/truths/engine.h"

namespace gapfarm::truths {

EngineKind planar_engine();

}  // namespace gapfarm::truths
