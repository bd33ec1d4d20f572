// Where searches of effects that have a place begin.

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/pose/segment.h"
#include "master/diagnose/places/patch_places.h"
#include "master/diagnose/push/push_subject.h"

namespace gapfarm {
namespace {

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
    std::vector<Patch> patches;
    for (const auto& [x, y] : places) {
      patches.push_back({static_cast<double>(x) * spacing, static_cast<double>(y) * spacing,
                         std::max(radius_m, spacing / kPatchSpacing), 1});
    }
    return patches;
  }
}

}  // namespace

bool piece_crosses(const ResidualTrial& trial, const Patch& patch) {
  constexpr double kExtent = 2.4;  // gyration radii: the farthest corner of a slender triangle
  const OnSegment nearest =
      nearest_on_segment({patch[0], patch[1]}, transform(trial.X_WS, trial.push.p_RC),
                         transform(trial.X_WP, trial.push.p_RC));
  return nearest.distance < patch[2] + kExtent * trial.push.gyration_m;
}

std::vector<infer::Start> push_patch_starts(const Study& study) {
  constexpr double kRadius_m = 0.06, kRatios[] = {0.45, 2};
  const ParameterTable& table = *study.table;
  std::vector<infer::Start> starts;
  for (Patch place : patch_grid(study, kRadius_m)) {
    infer::Start start;
    for (std::size_t i = 0; i < study.size(); ++i) {
      if (piece_crosses(study.trials[i], place)) {
        start.reach.push_back(static_cast<std::uint32_t>(i));
      }
    }
    if (start.reach.empty()) continue;
    for (const double ratio : kRatios) {
      place[3] = ratio;
      start.at.clear();
      const char* const keys[] = {"x", "y", "radius", "ratio"};
      for (std::size_t k = 0; k < 4; ++k) {
        start.at[table.row(std::string(kPatchEffect) + "." + keys[k])] = place[k];
      }
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
