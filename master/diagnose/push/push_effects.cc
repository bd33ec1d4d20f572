#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "common/base/ranges.h"
#include "common/pose/pose.h"
#include "master/diagnose/effect_diagnosis.h"
#include "master/diagnose/fit/signatures.h"
#include "master/diagnose/push/push_subject.h"

namespace gapfarm {
namespace {

// `model_error`: what strengths are off by on logs of another simulator, which has laws of its own
// (scripts/foreign_pushes.sh; one to three logs an effect).
std::vector<EffectDiagnosis> push_rows() {
  return {
      {.effect = "friction_anisotropy",
       .searched = {{"ratio", 0.2}},
       .polar = Polar{"friction_anisotropy.ratio", "friction_anisotropy.direction", 2, true},
       .model_error = 0.9,
       .direction_error_rad = 0.008,
       .phrases =
           {"Friction across the table's grain is %1 times that along it, and the grain runs at %2",
            {{"ratio", 1, ""}, {"direction", kDegrees, " degrees"}}}},
      {.effect = "friction_speed",
       .searched = {{"slope", 2}},
       .model_error = 0.08,
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
       .model_error = 0.6,
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
       .model_error = 0.06,
       .phrases = {"The support under the piece is drawn out by %1 (logarithm of its length over "
                   "its width) at %2 in the piece",
                   {{"stretch", 1, ""}, {"direction", kDegrees, " degrees"}}}},
      {.effect = "finger_compliance",
       .searched = {{"compliance", 0.001}},
       .model_error = 0.6,
       .phrases = {"The finger gives way by %1 to every newton", {{"compliance", 1000, " mm"}}}},
      {.effect = "placement_bias",
       .searched = {{"x", 0.002}, {"y", 0.002}, {"angle", 0.02, false, 0.3}},
       .model_error = 0.05,
       .phrases =
           {"Pieces truly start %1 along x and %2 along y from where the log says, turned by %3",
            {{"x", 1000, " mm"}, {"y", 1000, " mm"}, {"angle", 1000, " mrad"}}}},
  };
}

// What a camera does is reported, and is as unsure, whatever it looks at.
std::vector<EffectDiagnosis> camera_rows() {
  const EffectDiagnosis& aspect = *drive_effect_diagnoses().find("camera_aspect");
  const EffectDiagnosis& lens = *drive_effect_diagnoses().find("camera_distortion");
  return {
      {.effect = "marker_offset",
       .searched = {{"x", 0.003}, {"y", 0.003}},
       .aliases = {"com_offset"},
       .model_error = 0.03,
       .phrases = {"The marker sits %1 along x and %2 along y from where the outline says",
                   {{"x", 1000, " mm"}, {"y", 1000, " mm"}}}},
      {.effect = "frame_offset",
       .searched = {{"x", 0.002}, {"y", 0.002}},
       .phrases = {"Poses lie %1 along x and %2 along y from the finger's frame",
                   {{"x", 1000, " mm"}, {"y", 1000, " mm"}}}},
      {.effect = "camera_aspect",
       .searched = {{"ratio", 0.02, true}, {"camera_scale", 0.02, true}},
       .part = "pose_scale",
       .model_error = aspect.model_error,
       .phrases = {aspect.phrases.sentence, aspect.phrases.parameters}},
      {.effect = "pose_scale",
       .searched = {{"ratio", 0.02, true}},
       .model_error = aspect.model_error,
       .phrases = {"The camera's lengths are %1 times those of the finger's path",
                   {{"ratio", 1, ""}},
                   "Calibrate the camera's scale against the finger's"}},
      {.effect = "camera_distortion",
       .searched = {{"k1", 0.05}, {"x", 0.1}, {"y", 0.1}},
       .proposals = push_lens_starts,
       .start = lens.start,
       .model_error = lens.model_error,
       .places = lens.places,
       .phrases = {lens.phrases.sentence, lens.phrases.parameters}},
  };
}

constexpr double kPatchSpacing = 0.75;  // of the radius: a disc anywhere is overlapped by half
constexpr std::size_t kMostPatches = 150;

// Centres of discs over everything that pieces slide across, no more than there is time for.
std::vector<Patch> patch_grid(const Study& study, double radius_m) {
  double spacing = kPatchSpacing * radius_m;
  for (;; spacing *= 1.2) {
    std::vector<std::pair<long, long>> places;
    for (const ResidualTrial& t : study.trials) {
      for (const Pose& X : {t.X_WS, t.X_WP}) {
        const Eigen::Vector2d p = transform(X, t.push.p_RC);
        for (int k = 0; k < 4; ++k) {  // the piece's own extent
          const double dx = (k % 2 == 0 ? 1 : -1) * t.push.gyration_m;
          const double dy = (k < 2 ? 1 : -1) * t.push.gyration_m;
          places.emplace_back(std::lround((p.x() + dx) / spacing),
                              std::lround((p.y() + dy) / spacing));
        }
      }
    }
    std::sort(places.begin(), places.end());
    places.erase(std::unique(places.begin(), places.end()), places.end());
    if (places.size() > kMostPatches) continue;
    return mapped(places, [&](const auto& place) {
      return Patch{static_cast<double>(place.first) * spacing,
                   static_cast<double>(place.second) * spacing,
                   std::max(radius_m, spacing / kPatchSpacing), 1};
    });
  }
}

}  // namespace

const EffectDiagnoses& push_effect_diagnoses() {
  static const std::vector<EffectDiagnosis> rows =
      flattened(std::array{push_rows(), camera_rows()}, std::identity());
  static const EffectDiagnoses all(mapped(rows, [](const EffectDiagnosis& row) { return &row; }));
  return all;
}

bool piece_crosses(const ResidualTrial& trial, const Patch& patch) {
  constexpr double kExtent = 2.4;  // gyration radii: the farthest corner of a slender triangle
  const OnSegment nearest =
      nearest_on_segment({patch[0], patch[1]}, transform(trial.X_WS, trial.push.p_RC),
                         transform(trial.X_WP, trial.push.p_RC));
  return nearest.distance < patch[2] + kExtent * trial.push.gyration_m;
}

std::vector<infer::Start> push_patch_starts(const Study& study) {
  constexpr double kRadius_m = 0.06, kRatios[] = {0.45, 2};
  std::vector<infer::Start> starts;
  for (Patch place : patch_grid(study, kRadius_m)) {
    infer::Start start;
    for (std::uint32_t i = 0; i < study.size(); ++i) {
      if (piece_crosses(study.trials[i], place)) start.reach.push_back(i);
    }
    if (start.reach.empty()) continue;
    for (const double ratio : kRatios) {
      place[3] = ratio;
      set_values(*study.table, patch_values(place), &start.at);
      starts.push_back(start);
    }
  }
  return starts;
}

std::vector<infer::Start> push_lens_starts(const Study& study) {
  constexpr double kBend_m2 = 0.1;
  const Eigen::Vector2d middle = middle_of(study);
  const ParameterTable& table = *study.table;
  std::vector<infer::Start> starts;
  for (const double k1 : {kBend_m2, -kBend_m2}) {
    starts.push_back({{{table.row("camera_distortion.k1"), k1},
                       {table.row("camera_distortion.x"), middle.x()},
                       {table.row("camera_distortion.y"), middle.y()}},
                      {}});
  }
  return starts;
}

}  // namespace gapfarm
