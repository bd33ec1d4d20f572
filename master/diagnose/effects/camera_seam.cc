#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/places/seam.h"

namespace gapfarm {
namespace {

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
    (*values)[at.signature.parameters[k]] = at.coefficients[static_cast<Eigen::Index>(k)];
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

}  // namespace

extern const EffectDiagnosis kCameraSeam = first_seam();
extern const EffectDiagnosis kCameraSeam2 = second_of_a_kind(
    first_seam(), "camera_seam_2",
    "Beyond a second seam at %a = %1 the poses are shifted by %2 in x and %3 in y, too");

}  // namespace gapfarm
