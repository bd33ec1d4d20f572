// What has a place and is searched rather than sloped: patches of floor and seams.

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "master/diagnose/effects/patch_places.h"
#include "master/diagnose/seam.h"
#include "master/diagnose/selection.h"
#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

constexpr double kWorthSketched = 12.5;  // of patches; where there are none it reaches 11
// A disc that is off by half a step of the sketch shows a third of what the right one would.
constexpr double kMostOfMoving = 3;
constexpr int kSeamSteps = 10;
constexpr int kMostPatchSearches = 4;

}  // namespace

double net_gain(const Regression& explained, const Signature& s) {
  return explained.gain(s.columns).squares / 2 - s.penalty;
}

void Selector::look_for_patches() {
  patch_search_ = study_->subject->patches(*predictor_, *study_);
}

EffectCandidate Selector::refine_seam(const Regression& explained, EffectCandidate best) const {
  // The gain jumps as readings change sides, so everything near is tried.
  const int axis = static_cast<int>(best.signature.fixed.at("camera_seam.axis"));
  const double coarse = best.signature.fixed.at("camera_seam.position");
  for (int k = -kSeamSteps; k <= kSeamSteps; ++k) {
    Signature s = seam_signature(*study_, axis, coarse + k * kSeamStep_m);
    study_->drop_ignored(s.columns);
    const double gain = net_gain(explained, s);
    if (gain > best.gain) best = {gain, std::move(s)};
  }
  return best;
}

// A line near the edge of where trials were bends all that lies beyond it, a lens whose middle is
// far away all that it sees.
void Selector::drop_linear_views(const Regression& explained,
                                 std::map<std::string, EffectCandidate>* best) const {
  std::optional<double> linear;
  std::erase_if(*best, [&](const auto& entry) {
    const auto& [effect, candidate] = entry;
    if (!study_->subject->effects->row(effect).bends_view) return false;
    if (candidate.gain < study_->subject->least_gain) return false;
    if (!linear) {
      Signature view = linear_view_signature(*study_);
      study_->drop_ignored(view.columns);
      linear = net_gain(explained, view);
    }
    return *linear >= candidate.gain;
  });
}

// Simulates discs, in their order; they join the catalogue.
Result<std::vector<EffectCandidate>> Selector::simulate_patches(const Regression& explained,
                                                                const std::vector<Patch>& patches) {
  auto found = patch_signatures(*predictor_, *study_, patches);
  if (!found) return found.error();
  std::vector<EffectCandidate> simulated;
  for (Signature& s : *found) {
    study_->drop_ignored(s.columns);
    simulated.push_back({net_gain(explained, s), s});
    catalogue_.push_back(std::move(s));
  }
  return simulated;
}

// A disc that the sketch proposes, moved to where the simulation explains most: every step tries
// both ways along x, y, radius and ratio, then all that helped at once.
Status Selector::refine_patch(const Regression& explained, EffectCandidate best) {
  for (double step : {0.04, 0.02, 0.01}) {
    const Patch from = patch_of(best.signature);
    std::vector<Patch> moves;
    for (std::size_t k = 0; k < 8; ++k) {
      const double sign = k % 2 == 0 ? 1 : -1;
      Patch& to = moves.emplace_back(from);
      double& moved = to[k / 2];
      moved = k < 6 ? moved + sign * step : moved * std::pow(1 + 6 * step, sign);
      to[2] = std::max(to[2], 0.05);
      to[3] = std::clamp(to[3], 0.06, 2.9);
    }
    auto tried = simulate_patches(explained, moves);
    if (!tried) return tried.error();
    const double before = best.gain;
    Patch together = from;
    for (std::size_t k = 0; k < 8; k += 2) {
      const EffectCandidate& better =
          (*tried)[k].gain > (*tried)[k + 1].gain ? (*tried)[k] : (*tried)[k + 1];
      if (better.gain > before) together[k / 2] = patch_of(better.signature)[k / 2];
      if (better.gain > best.gain) best = better;
    }
    auto all = simulate_patches(explained, {together});
    if (!all) return all.error();
    if (all->front().gain > best.gain) best = all->front();
  }
  refined_patches_.push_back(patch_of(best.signature));
  return {};
}

// Adds to the catalogue what the sketch finds in the data that are left, where a search has not
// been yet.
Status Selector::search_patches(const Regression& explained, double most_gain) {
  if (!patch_search_ || patch_searches_ >= kMostPatchSearches) return {};
  const double worth = std::max(kWorthSketched, kWorthRefiningShare * most_gain);
  std::vector<Patch> starts;
  const auto places = patch_search_(explained, 3, 2 * worth);
  if (!places) return places.error();
  for (const Patch& place : *places) {
    const bool known =
        std::any_of(refined_patches_.begin(), refined_patches_.end(), [&](const Patch& p) {
          return std::hypot(p[0] - place[0], p[1] - place[1], p[2] - place[2]) < 0.15;
        });
    if (known) continue;
    starts.push_back(place);
    starts.push_back(place);
    starts.back()[3] = std::sqrt(place[3]);
  }
  if (starts.empty()) return {};
  ++patch_searches_;
  auto simulated = simulate_patches(explained, starts);
  if (!simulated) return simulated.error();
  const EffectCandidate& best = *std::max_element(
      simulated->begin(), simulated->end(),
      [](const EffectCandidate& a, const EffectCandidate& b) { return a.gain < b.gain; });
  if (best.gain + best.signature.penalty < kWorthRefining) return {};
  if (kMostOfMoving * best.gain < most_gain) return {};  // its turn comes when that is explained
  return refine_patch(explained, best);
}

}  // namespace gapfarm
