#include <numbers>

#include "master/diagnose/push/push_subject.h"

namespace gapfarm {

const EffectWordsByName& push_effect_words() {
  constexpr double kDegrees = 180 / std::numbers::pi;
  static const EffectWordsByName words = {
      {"friction_anisotropy",
       {"Friction across the table's grain is %1 times that along it, and the grain runs at %2",
        {{"ratio", 1, ""}, {"direction", kDegrees, " degrees"}}}},
      {"friction_speed",
       {"Friction with the table grows by %1 of itself with every m/s", {{"slope", 100, " %"}}}},
      {"friction_patch",
       {"A patch of table around x = %2, y = %3 of radius %4 has %1 times the friction",
        {{"ratio", 1, ""}, {"x", 1, " m"}, {"y", 1, " m"}, {"radius", 1000, " mm"}}}},
      {"table_tilt",
       {"The table falls by %1 toward %2",
        {{"angle", 1000, " mrad"}, {"direction", kDegrees, " degrees"}}}},
      {"com_offset",
       {"The centre of mass lies %1 along x and %2 along y from the piece's centroid",
        {{"x", 1000, " mm"}, {"y", 1000, " mm"}}}},
      {"pressure_distribution",
       {"The support under the piece is drawn out by %1 (logarithm of its length over its width) "
        "at %2 in the piece",
        {{"stretch", 1, ""}, {"direction", kDegrees, " degrees"}}}},
      {"finger_compliance",
       {"The finger gives way by %1 to every newton", {{"compliance", 1000, " mm"}}}},
      {"placement_bias",
       {"Pieces truly start %1 along x and %2 along y from where the log says, turned by %3",
        {{"x", 1000, " mm"}, {"y", 1000, " mm"}, {"angle", 1000, " mrad"}}}},
      {"marker_offset",
       {"The marker sits %1 along x and %2 along y from where the outline says",
        {{"x", 1000, " mm"}, {"y", 1000, " mm"}}}}};
  return words;
}

}  // namespace gapfarm
