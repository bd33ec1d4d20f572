#include "master/diagnose/effects/effect_diagnosis.h"
#include "master/diagnose/effects/patch_places.h"

namespace gapfarm {
namespace {

// What a camera does is told, and is as unsure, whatever it looks at.
std::vector<EffectDiagnosis> pushed_rows() {
  const EffectDiagnosis& aspect = *drive_effect_diagnoses().find("camera_aspect");
  const EffectDiagnosis& lens = *drive_effect_diagnoses().find("camera_distortion");
  return {
      {.effect = "friction_anisotropy",
       .polar = Polar{"friction_anisotropy.ratio", "friction_anisotropy.direction", 2, true},
       .words = {"Friction across the table's grain is %1 times that along it, and the grain runs "
                 "at %2",
                 {{"ratio", 1, ""}, {"direction", kDegrees, " degrees"}}}},
      {.effect = "friction_speed",
       .words = {"Friction with the table grows by %1 of itself with every m/s",
                 {{"slope", 100, " %"}}}},
      {.effect = kPatchEffect,
       .search_error = patch_search_error,
       .places = {{"x", 0}, {"y", 1}},
       .told_by = {"x", "y", "radius"},
       .words = {"A patch of table around x = %2, y = %3 of radius %4 has %1 times the friction",
                 {{"ratio", 1, ""}, {"x", 1, " m"}, {"y", 1, " m"}, {"radius", 1000, " mm"}}}},
      {.effect = "table_tilt",
       .polar = Polar{"table_tilt.angle", "table_tilt.direction", 1, false},
       .words = {"The table falls by %1 toward %2",
                 {{"angle", 1000, " mrad"}, {"direction", kDegrees, " degrees"}}}},
      {.effect = "com_offset",
       .aliases = {"marker_offset"},
       .model_error = 0.15,
       .words = {"The centre of mass lies %1 along x and %2 along y from the piece's centroid",
                 {{"x", 1000, " mm"}, {"y", 1000, " mm"}}}},
      {.effect = "pressure_distribution",
       .polar = Polar{"pressure_distribution.stretch", "pressure_distribution.direction", 2, false},
       .words = {"The support under the piece is drawn out by %1 (logarithm of its length over its "
                 "width) at %2 in the piece",
                 {{"stretch", 1, ""}, {"direction", kDegrees, " degrees"}}}},
      {.effect = "finger_compliance",
       .words = {"The finger gives way by %1 to every newton", {{"compliance", 1000, " mm"}}}},
      {.effect = "placement_bias",
       .words = {"Pieces truly start %1 along x and %2 along y from where the log says, turned by "
                 "%3",
                 {{"x", 1000, " mm"}, {"y", 1000, " mm"}, {"angle", 1000, " mrad"}}}},
      {.effect = "marker_offset",
       .aliases = {"com_offset"},
       .model_error = 0.03,
       .words = {"The marker sits %1 along x and %2 along y from where the outline says",
                 {{"x", 1000, " mm"}, {"y", 1000, " mm"}}}},
      {.effect = "camera_aspect", .model_error = aspect.model_error, .words = aspect.words},
      {.effect = "camera_distortion",
       .start = lens.start,
       .model_error = lens.model_error,
       .places = lens.places,
       .words = lens.words},
  };
}

}  // namespace

const EffectDiagnoses& push_effect_diagnoses() {
  static const std::vector<EffectDiagnosis> rows = pushed_rows();
  static const EffectDiagnoses all([] {
    std::vector<const EffectDiagnosis*> each;
    for (const EffectDiagnosis& row : rows) each.push_back(&row);
    return each;
  }());
  return all;
}

}  // namespace gapfarm
