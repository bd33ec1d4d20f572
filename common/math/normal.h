// The normal distribution's numbers.
#pragma once

namespace gapfarm {

inline constexpr double kNormal90 = 1.645;  // half a 90 % interval, in standard deviations
inline constexpr double kLogTwoPi = 1.8378770664093454836;  // ln(2 pi)

}  // namespace gapfarm
