// Sizes of a tracked robot that are no parameters.
#pragma once

namespace gapfarm {

struct RobotSize {
  // The outline; the mass is spread over this box for the moments of inertia.
  double body_length_m = 0, body_width_m = 0, body_height_m = 0;
  // Spheres on which the tread model stands.
  double contact_radius_m = 0;
  // Wheels of the wheel model; surface speed = radius * wheel speed.
  double wheel_radius_m = 0, wheel_half_width_m = 0;
  // Of a contact, in Bullet's units of 1 / mass: a heavy robot must not sink in.
  double contact_softness = 0;

  bool operator==(const RobotSize&) const = default;
};

}  // namespace gapfarm
