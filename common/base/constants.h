// Numbers that more than one place takes, each with what it is.
#pragma once

#include <numbers>

namespace gapfarm {

// Standard gravity to three digits: where nobody says otherwise.
inline constexpr double kGravity_m_s2 = 9.81;
// Speed that a contact's creep has at rest in the simulation, and in what is sketched of it: what
// stands holds, but not like rock.
inline constexpr double kCreepAtRest_m_s = 1.5e-3;
inline constexpr double kDegree = std::numbers::pi / 180;

}  // namespace gapfarm
