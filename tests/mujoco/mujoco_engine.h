// A skid-steered robot in MuJoCo: a rigid body in space on ball-shaped wheels, three a side, each
// with a hinge and a motor that holds the speed which it is reported.
#pragma once

#include "tests/truths/engine.h"

namespace gapfarm::truths {

EngineKind mujoco_engine();

}  // namespace gapfarm::truths
