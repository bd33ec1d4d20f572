// The only include of Bullet, and the promise that it is the double-precision library.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <type_traits>

static_assert(std::is_same_v<btScalar, double>,
              "gapfarm needs Bullet in double precision: link PkgConfig::bullet (bullet-float64)");
