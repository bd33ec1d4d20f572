#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/places/patch_places.h"
#include "master/diagnose/push/push_subject.h"

namespace gapfarm {
namespace {

// What a camera does is reported, and is as unsure, whatever it looks at.
std::vector<EffectDiagnosis> pushed_rows() {
  const EffectDiagnosis& aspect = *drive_effect_diagnoses().find("camera_aspect");
  const EffectDiagnosis& lens = *drive_effect_diagnoses().find("camera_distortion");
  return {
      {.effect = "friction_anisotropy",
       .searched = {{"ratio", 0.2}},
       .polar = Polar{"friction_anisotropy.ratio", "friction_anisotropy.direction", 2, true},
       .phrases =
           {"Friction across the table's grain is %1 times that along it, and the grain runs "
            "at %2",
            {{"ratio", 1, ""}, {"direction", kDegrees, " degrees"}}}},
      {.effect = "friction_speed",
       .searched = {{"slope", 2}},
       .phrases = {"Friction with the table grows by %1 of itself with every m/s",
                   {{"slope", 100, " %"}}}},
      {.effect = kPatchEffect,
       .searched = {{"ratio", 0.4, true}, {"x", 0.05}, {"y", 0.05}, {"radius", 0.4, true}},
       .proposals = push_patch_starts,
       .search_error = patch_search_error,
       .places = {{"x", 0}, {"y", 1}},
       .identified_by = {"x", "y", "radius"},
       .phrases = {"A patch of table around x = %2, y = %3 of radius %4 has %1 times the friction",
                   {{"ratio", 1, ""}, {"x", 1, " m"}, {"y", 1, " m"}, {"radius", 1000, " mm"}}}},
      {.effect = "table_tilt",
       .searched = {{"angle", 0.03}},
       .polar = Polar{"table_tilt.angle", "table_tilt.direction", 1, false},
       .phrases = {"The table falls by %1 toward %2",
                   {{"angle", 1000, " mrad"}, {"direction", kDegrees, " degrees"}}}},
      {.effect = "com_offset",
       .searched = {{"x", 0.003}, {"y", 0.003}},
       .aliases = {"marker_offset"},
       .model_error = 0.15,
       .phrases = {"The centre of mass lies %1 along x and %2 along y from the piece's centroid",
                   {{"x", 1000, " mm"}, {"y", 1000, " mm"}}}},
      {.effect = "pressure_distribution",
       .searched = {{"stretch", 0.15}},
       .polar = Polar{"pressure_distribution.stretch", "pressure_distribution.direction", 2, false},
       .phrases =
           {"The support under the piece is drawn out by %1 (logarithm of its length over its "
            "width) at %2 in the piece",
            {{"stretch", 1, ""}, {"direction", kDegrees, " degrees"}}}},
      {.effect = "finger_compliance",
       .searched = {{"compliance", 0.001}},
       .phrases = {"The finger gives way by %1 to every newton", {{"compliance", 1000, " mm"}}}},
      {.effect = "placement_bias",
       .searched = {{"x", 0.002}, {"y", 0.002}, {"angle", 0.02}},
       .phrases =
           {"Pieces truly start %1 along x and %2 along y from where the log says, turned by "
            "%3",
            {{"x", 1000, " mm"}, {"y", 1000, " mm"}, {"angle", 1000, " mrad"}}}},
      {.effect = "marker_offset",
       .searched = {{"x", 0.003}, {"y", 0.003}},
       .aliases = {"com_offset"},
       .model_error = 0.03,
       .phrases = {"The marker sits %1 along x and %2 along y from where the outline says",
                   {{"x", 1000, " mm"}, {"y", 1000, " mm"}}}},
      {.effect = "camera_aspect",
       .searched = {{"ratio", 0.02, true}, {"camera_scale", 0.02, true}},
       .model_error = aspect.model_error,
       .phrases = aspect.phrases},
      {.effect = "camera_distortion",
       .searched = {{"k1", 0.05}, {"x", 0.1}, {"y", 0.1}},
       .proposals = push_lens_starts,
       .start = lens.start,
       .model_error = lens.model_error,
       .places = lens.places,
       .phrases = lens.phrases},
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
