#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "common/pose/segment.h"
#include "common/score/statistics.h"
#include "master/diagnose/probes.h"
#include "master/diagnose/push/push_subject.h"

namespace gapfarm {
namespace {

constexpr double kPatchSpacing = 0.75;  // of the radius: a disc anywhere is overlapped by half
constexpr double kPatchRadius_m = 0.12;
constexpr double kProbedRatio = 0.4;
constexpr std::size_t kMostPatches = 150;

double typical_speed(const Study& study) {
  std::vector<double> speeds;
  for (const ResidualTrial& t : study.trials) {
    if (t.push.touched) speeds.push_back(t.push.speed_m_s);
  }
  return speeds.empty() ? 0.1 : median(speeds);
}

std::vector<Probe> push_probes(const Study& study) {
  std::vector<Probe> all;
  const auto both = [&](const std::string& effect, const std::string& key, double step,
                        double neutral = 0) {
    const std::string row = effect + "." + key;
    all.push_back({effect, {{row, neutral + step}}, {{row, neutral - step}}, 2 * step});
  };
  // As much of the friction as a fifth of the speed's own share, within the catalogue's bounds.
  both("friction_speed", "slope", std::min(4.9, 0.2 / std::max(typical_speed(study), 1e-3)));
  both("com_offset", "x", 0.002);
  both("com_offset", "y", 0.002);
  all.push_back({"finger_compliance", {{"finger_compliance.compliance", 5e-4}}, {}, 5e-4});
  both("camera_aspect", "ratio", 0.02, 1);
  both("marker_offset", "x", 0.003);
  both("marker_offset", "y", 0.003);
  // A strength and a direction: linear in the strength's cosine and sine.
  constexpr double kLogRatio = 0.2, kStretch = 0.1, kTilt = 0.03;
  for (double direction : {0.0, std::numbers::pi / 4}) {
    const auto grain = [&](double log_ratio) {
      return std::map<std::string, double>{{"friction_anisotropy.ratio", std::exp(log_ratio)},
                                           {"friction_anisotropy.direction", direction}};
    };
    all.push_back({"friction_anisotropy", grain(kLogRatio), grain(-kLogRatio), 2 * kLogRatio});
    const auto plate = [&](double stretch) {
      return std::map<std::string, double>{{"pressure_distribution.stretch", stretch},
                                           {"pressure_distribution.direction", direction}};
    };
    all.push_back({"pressure_distribution", plate(kStretch), plate(-kStretch), 2 * kStretch});
  }
  for (double direction : {0.0, std::numbers::pi / 2}) {
    const auto tilt = [&](double toward) {
      return std::map<std::string, double>{{"table_tilt.angle", kTilt},
                                           {"table_tilt.direction", toward}};
    };
    all.push_back(
        {"table_tilt", tilt(direction), tilt(wrap_angle(direction + std::numbers::pi)), 2 * kTilt});
  }
  for (Probe& probe : lens_probes(middle_of(study))) all.push_back(std::move(probe));
  return all;
}

// What the start's own noise shows already: where the piece truly starts.
Signature placement_signature(const Study& study) {
  Signature s;
  s.effect = "placement_bias";
  std::vector<Eigen::VectorXd> columns;
  for (int k = 0; k < 3; ++k) {
    std::vector<Eigen::Vector3d> d;
    for (const ResidualTrial& t : study.trials) d.push_back(t.spread.start.col(k));
    columns.push_back(study.whiten(d));
  }
  s.columns = stack(columns);
  s.parameters = {"placement_bias.x", "placement_bias.y", "placement_bias.angle"};
  s.penalty = 1.5;
  return s;
}

// Centres of discs over everything that pieces slide across, no more than there is time for.
std::vector<Patch> patch_grid(const Study& study) {
  double spacing = kPatchSpacing * kPatchRadius_m;
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
                         std::max(kPatchRadius_m, spacing / kPatchSpacing), kProbedRatio});
    }
    return patches;
  }
}

}  // namespace

Result<std::vector<Signature>> push_signatures(Predictor& predictor, const Study& study,
                                               const std::vector<std::string>& left_out) {
  const std::vector<Probe> all = push_probes(study);
  auto probed = probe_all(predictor, study, all);
  if (!probed) return probed.error();
  std::vector<Signature> found;
  for (std::size_t k = 0; k < all.size();) {
    Signature s;
    s.effect = all[k].effect;
    std::vector<Eigen::VectorXd> columns;
    for (std::size_t j = k; j < all.size(); ++j) {
      if (all[j].effect != s.effect) continue;
      if ((*probed)[j].empty()) columns.clear();
      if ((*probed)[j].empty()) break;
      columns.push_back(study.whiten((*probed)[j]));
      if (all[j].plus.size() == 1) s.parameters.push_back(all[j].plus.begin()->first);
    }
    if (!columns.empty()) s.columns = stack(columns);  // else left out below
    s.penalty = 0.5 * static_cast<double>(columns.size());
    found.push_back(std::move(s));
    // To the next effect that is not there yet.
    const auto there = [&](const std::string& effect) {
      return std::any_of(found.begin(), found.end(),
                         [&](const Signature& f) { return f.effect == effect; });
    };
    while (k < all.size() && there(all[k].effect)) ++k;
  }
  found.push_back(placement_signature(study));
  std::erase_if(found, [&](const Signature& s) {
    return s.columns.cols() == 0 ||
           std::find(left_out.begin(), left_out.end(), s.effect) != left_out.end();
  });
  return found;
}

bool piece_crosses(const ResidualTrial& trial, const Patch& patch) {
  constexpr double kExtent = 2.4;  // gyration radii: the farthest corner of a slender triangle
  const OnSegment nearest =
      nearest_on_segment({patch[0], patch[1]}, transform(trial.X_WS, trial.push.p_RC),
                         transform(trial.X_WP, trial.push.p_RC));
  return nearest.distance < patch[2] + kExtent * trial.push.gyration_m;
}

std::vector<PatchReach> push_patch_reach(const Problem&, const Study& study, const Patch& patch) {
  std::vector<PatchReach> reach;
  for (const ResidualTrial& trial : study.trials) {
    reach.push_back(piece_crosses(trial, patch) ? PatchReach::kRim : PatchReach::kNone);
  }
  return reach;
}

PatchSearch push_patches(Predictor& predictor, const Study& study) {
  // Simulated when first asked for; what is explained changes, the marks do not.
  const auto grid = std::make_shared<std::vector<Signature>>();
  return [&predictor, &study, grid](const Regression& explained,
                                    const PatchWish& wish) -> Result<std::vector<Patch>> {
    const std::vector<Patch> places = patch_grid(study);
    if (grid->empty()) {
      auto marks = patch_signatures(predictor, study, places);
      if (!marks) return marks.error();
      *grid = std::move(*marks);
    }
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t k = 0; k < grid->size(); ++k) {
      Eigen::MatrixXd mark = (*grid)[k].columns;
      study.drop_ignored(mark);
      order.emplace_back(-explained.gain(mark).squares, k);
    }
    std::sort(order.begin(), order.end());
    std::vector<Patch> best;
    for (const auto& [squares, k] : order) {
      if (-squares < wish.least || best.size() == wish.most) break;
      const Patch& place = places[k];
      if (wish.beside && !are_two_patches(*wish.beside, place)) continue;
      const bool near = std::any_of(best.begin(), best.end(), [&](const Patch& p) {
        return std::hypot(p[0] - place[0], p[1] - place[1]) < p[2];
      });
      if (!near) best.push_back(place);
    }
    return best;
  };
}

}  // namespace gapfarm
