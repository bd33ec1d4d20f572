// The normal distribution's numbers.
#pragma once

namespace gapfarm {

inline constexpr double kNormal90 = 1.645;  // half a 90 % interval, in standard deviations

}  // namespace gapfarm
