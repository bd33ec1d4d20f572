// Effects with a place: what cameras do to positions, and patches of floor.
#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/pose/pose.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/fit/signatures.h"
#include "master/diagnose/places/seam.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

// Columns of lens_probes(): the strength, then strength times how far its centre is off.
void start_lens(const EffectStart& at, std::map<std::string, double>* values) {
  const Eigen::VectorXd& c = at.coefficients;
  const Eigen::Vector2d middle = middle_of(at.study);
  const double k1 = std::abs(c[0]) > 1e-6 ? c[0] : 1e-6;
  (*values)["camera_distortion.k1"] = k1;
  (*values)["camera_distortion.x"] = middle.x() + std::clamp(c[1] / k1, -1.0, 1.0);
  (*values)["camera_distortion.y"] = middle.y() + std::clamp(c[2] / k1, -1.0, 1.0);
}

// Lines across both axes, from where few trials are on one side to where few are on the other.
std::vector<Signature> lines(const Study& study) {
  std::vector<Signature> found;
  for (int axis = 0; axis < 2; ++axis) {
    std::vector<double> places = mapped(
        study.trials, [&](const ResidualTrial& t) { return axis == 0 ? t.X_WS.x : t.X_WS.y; });
    std::sort(places.begin(), places.end());
    const double lower = places[places.size() * 8 / 100], upper = places[places.size() * 92 / 100];
    for (int k = 0; upper > lower && k < 29; ++k) {
      found.push_back(seam_signature(study, axis, lower + (upper - lower) * k / 28));
    }
  }
  return found;
}

// Slopes of the signature are about the middle; the catalogue's are about zero.
void start_seam(const EffectStart& at, std::map<std::string, double>* values) {
  const std::string& e = at.signature.effect;
  const Eigen::Vector2d middle = middle_of(at.study);
  for (std::size_t k = 0; k < at.signature.parameters.size(); ++k) {
    (*values)[at.signature.parameters[k]] = at.coefficients[k];
  }
  const double along = at.signature.fixed.at(e + ".axis") == 0 ? middle.y() : middle.x();
  (*values)[e + ".position"] =
      seam_position(at.study, at.others, at.signature, at.coefficients.head<4>());
  (*values)[e + ".offset_x"] -= along * (*values)[e + ".slope_x"];
  (*values)[e + ".offset_y"] -= along * (*values)[e + ".slope_y"];
}

double seam_search_error(const Parameter& p, double, double) {
  return is_seam_position(p.key) ? kSeamStep_m : 0;
}

// Within a shift's width of a seam both cameras may have reported a reading.
double seam_ambiguity(const Study& study, const Parameter& p, const Overrides& at) {
  if (!is_seam_position(p.key)) return 0;
  const auto value = [&](const char* key) { return at.at(study.table->row(p.effect + "." + key)); };
  const bool across_x = value("axis") == 0;
  const Eigen::Vector2d middle = middle_of(study);
  const double along = across_x ? middle.y() : middle.x();
  const double shift = across_x ? value("offset_x") + along * value("slope_x")
                                : value("offset_y") + along * value("slope_y");
  return std::abs(shift) / kNormal90;
}

// Which camera saw a pose on the line is not known.
bool contaminated_at_line(const Signature& chosen, const ResidualTrial& trial) {
  const Eigen::Vector2d from(trial.X_WS.x, trial.X_WS.y), to(trial.X_WP.x, trial.X_WP.y);
  const int axis = chosen.fixed.at(chosen.effect + ".axis") == 0 ? 0 : 1;
  const double line = chosen.fixed.at(chosen.effect + ".position");
  return std::abs(to[axis] - line) < 0.03 || std::abs(from[axis] - line) < 0.01;
}

// Sizes: cameras over one arena disagreed by 20 cm (docs/evidence/diagnosis.md, a real
// robot), which is as far as the prior expects.
EffectDiagnosis first_seam() {
  return {
      .effect = "camera_seam",
      .searched = {{"offset_x", 0.05}, {"offset_y", 0.05}, {"slope_x", 0.05}, {"slope_y", 0.05}},
      .marks = lines,
      .bends_view = true,
      .start = start_seam,
      .model_error = 0.05,
      .search_error = seam_search_error,
      .ambiguity = seam_ambiguity,
      .places = {{"position", -1}},
      .identified_by = {"axis", "position"},
      .are_two = are_two_seams,
      .contaminates = contaminated_at_line,
      .phrases = {"Beyond a seam at %a = %1 the poses are shifted by %2 in x and %3 in y",
                  {{"position", 1, " m"}, {"offset_x", 1000, " mm"}, {"offset_y", 1000, " mm"}},
                  "Calibrate the cameras against each other at the seam",
                  "Two cameras disagree at %a = %1",
                  "Two cameras disagree at %a = −%1"},
  };
}

// At its edge a small error of the place is a large one of the motion.
bool contaminated_at_edge(const Signature& chosen, const ResidualTrial& trial) {
  constexpr double kEdge_m = 0.1;
  const Eigen::Vector2d from(trial.X_WS.x, trial.X_WS.y), to(trial.X_WP.x, trial.X_WP.y);
  const Patch patch = patch_of(chosen);
  return nearest_on_segment({patch[0], patch[1]}, from, to).distance < patch[2] + kEdge_m;
}

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

extern const EffectDiagnosis kCameraDistortion = {
    .effect = "camera_distortion",
    .searched = {{"k1", 0.05}, {"x", 0.1}, {"y", 0.1}},
    .probes = [](const Study& study) { return lens_probes(middle_of(study)); },
    .bends_view = true,
    .start = start_lens,
    .model_error = 0.03,
    .places = {{"x", 0}, {"y", 1}},
    .phrases = {"The lens distorts radially with k1 = %1 about x = %2, y = %3 of the world",
                {{"k1", 1, " 1/m^2"}, {"x", 1, " m"}, {"y", 1, " m"}},
                "Calibrate the lens",
                "The camera's lens bends positions"},
};

extern const EffectDiagnosis kCameraSeam = first_seam();
extern const EffectDiagnosis kCameraSeam2 = second_of_a_kind(
    first_seam(), "camera_seam_2",
    "Beyond a second seam at %a = %1 the poses are shifted by %2 in x and %3 in y, too");

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

extern const EffectDiagnosis kFrictionPatch = first_patch();
extern const EffectDiagnosis kFrictionPatch2 =
    second_of_a_kind(first_patch(), "friction_patch_2",
                     "A second patch of floor around x = %2, y = %3 of the world, of radius %4 has "
                     "%1 times the friction");

}  // namespace gapfarm
