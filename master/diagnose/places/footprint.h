// Where a robot on two sides stands on the floor, as the search for patches needs it.
#pragma once

#include <Eigen/Core>
#include <array>

#include "master/diagnose/study.h"

namespace gapfarm {

struct Footprint {
  double length_m = 0, gauge_m = 0;
  double friction_ratio = 1;  // lateral over longitudinal
  double creep = 0;           // slip speed over tread speed

  // Left front, left rear, right front, right rear; body axes, m.
  std::array<Eigen::Vector2d, 4> contacts() const;
};

// With the study's base.
Footprint footprint_of(const Problem& problem, const Study& study);

}  // namespace gapfarm
