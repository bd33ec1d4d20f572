// How far the heading that was logged of a start may be turned from the robot's.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace gapfarm {

struct StartTurn {
  double weight = 1;
  double turn_rad = 0;  // of the logged heading, to the left of the robot's
};

// By up to an angle either way, all angles alike: as many alternatives as leave no gap between
// them. Weights sum to 1.
inline std::vector<StartTurn> uniform_turns(double angle_rad) {
  constexpr double kStep_rad = 0.04;  // two readings of a heading differ by as much
  const int count = std::clamp(static_cast<int>(std::ceil(2 * angle_rad / kStep_rad)), 5, 101);
  std::vector<StartTurn> turns;
  for (int k = 0; k < count; ++k) {
    turns.push_back({1.0 / count, angle_rad * ((2 * k + 1.0) / count - 1)});
  }
  return turns;
}

}  // namespace gapfarm
