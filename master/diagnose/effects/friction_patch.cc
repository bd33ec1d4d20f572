#include <algorithm>
#include <cmath>

#include "common/pose/pose.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/fit/signatures.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// At its edge a small error of the place is a large one of the motion.
bool contaminated_at_edge(const Signature& chosen, const ResidualTrial& trial) {
  constexpr double kEdge_m = 0.1;
  const Eigen::Vector2d from(trial.X_WS.x, trial.X_WS.y), to(trial.X_WP.x, trial.X_WP.y);
  const Patch patch = patch_of(chosen);
  return nearest_on_segment({patch[0], patch[1]}, from, to).distance < patch[2] + kEdge_m;
}

}  // namespace

Patch patch_of(const Signature& s) {
  const auto value = [&](const char* key) { return s.fixed.at(s.effect + "." + key); };
  return {value("x"), value("y"), value("radius"), value("ratio")};
}

std::map<std::string, double> patch_values(const Patch& patch) {
  return {{"friction_patch.ratio", patch[3]},
          {"friction_patch.x", patch[0]},
          {"friction_patch.y", patch[1]},
          {"friction_patch.radius", patch[2]}};
}

double patch_search_error(const Parameter& p, double value, double gain) {
  const double weakness = 1 / std::sqrt(2 * std::max(gain, 1.0));
  return p.key == p.effect + ".ratio" ? kPatchRatio * weakness * (value - p.nominal)
                                      : kPatchPlace_m * weakness;
}

namespace {

// Looked for by its place: what a sketch proposes is simulated (patch.h).
EffectDiagnosis first_patch() {
  return {
      .effect = kPatchEffect,
      .searched = {{"ratio", 0.4, true}, {"x", 0.05}, {"y", 0.05}, {"radius", 0.4, true}},
      .search_error = patch_search_error,
      .places = {{"x", 0}, {"y", 1}},
      .identified_by = {"x", "y", "radius"},
      .are_two = [](const Signature& a,
                    const Signature& b) { return are_two_patches(patch_of(a), patch_of(b)); },
      .saturates = "ratio",
      .contaminates = contaminated_at_edge,
      .phrases = {"A patch of floor around x = %2, y = %3 of the world, of radius %4 has %1 times "
                  "the friction",
                  {{"ratio", 1, ""}, {"x", 1, " m"}, {"y", 1, " m"}, {"radius", 1000, " mm"}},
                  "Look at the floor there",
                  "A patch of the floor has %1 times the friction"},
  };
}

}  // namespace

extern const EffectDiagnosis kFrictionPatch = first_patch();
extern const EffectDiagnosis kFrictionPatch2 =
    second_of_a_kind(first_patch(), "friction_patch_2",
                     "A second patch of floor around x = %2, y = %3 of the world, of radius %4 has "
                     "%1 times the friction");

}  // namespace gapfarm
