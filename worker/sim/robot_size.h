// Sizes of the robot that are not parameters, m.
#pragma once

namespace gapfarm {

// The SRV-1's outline; its mass is spread over this box for the moments of inertia.
inline constexpr double kBodyLength_m = 0.12;
inline constexpr double kBodyWidth_m = 0.10;
inline constexpr double kBodyHeight_m = 0.08;
// Spheres on which the tread model stands.
inline constexpr double kContactRadius_m = 0.005;
// Wheels of the wheel model; surface speed = radius * wheel speed.
inline constexpr double kWheelRadius_m = 0.025;
inline constexpr double kWheelHalfWidth_m = 0.006;
// Share of the mass in each wheel: 40 g of 350 g.  A share keeps the joints equally well
// conditioned over the whole range of masses.
inline constexpr double kWheelMassShare = 4.0 / 35.0;

}  // namespace gapfarm
