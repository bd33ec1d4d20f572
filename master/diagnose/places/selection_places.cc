// What has a place and is searched rather than sloped: patches of floor and seams.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "master/diagnose/fit/selection.h"
#include "master/diagnose/places/patch_climb.h"
#include "master/diagnose/places/patch_places.h"
#include "master/diagnose/places/seam.h"
#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

constexpr double kWorthSketched = 12.5;  // of patches; where there are none it reaches 11
// A disc that is off by half a step of the sketch shows a third of what the right one would.
constexpr double kMostOfMoving = 3;
// Times what a simulated disc does, or a part of it: where a fit would have more, or the opposite,
// the data ask for no such disc.
constexpr double kMostOfItself = 3;
constexpr int kSeamSteps = 10;
constexpr int kMostPatchSearches = 4, kMostSecondPatchSearches = 2;
// The ratio is what the sketch is least sure of.
constexpr std::array<double, 3> kRatioPowers = {0.5, 1, 2};

bool better(const EffectCandidate& a, const EffectCandidate& b) { return a.gain > b.gain; }

}  // namespace

double net_gain(const Regression& explained, const Signature& s) {
  const bool one = s.whole && s.columns.cols() == 1;
  const double squares =
      one ? explained.gain_within(s.columns.col(0), 1 / kMostOfItself, kMostOfItself)
          : explained.gain(s.columns).squares;
  return squares / 2 - s.penalty;
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

// Adds to the catalogue what the sketch finds in the data that are left, where a search has not
// been yet; `beside`: another one than this.
Status Selector::search_patches(const Regression& explained, double most_gain,
                                const std::optional<Patch>& beside) {
  int& searches = beside ? second_patch_searches_ : patch_searches_;
  if (!patch_search_ || searches >= (beside ? kMostSecondPatchSearches : kMostPatchSearches)) {
    return {};
  }
  const double worth =
      std::max(beside ? kLeastSecondOfAKind : kWorthSketched, kWorthRefiningShare * most_gain);
  std::vector<Patch> starts;
  const auto places = patch_search_(explained, {3, 2 * worth, beside});
  if (!places) return places.error();
  for (const Patch& place : *places) {
    const bool known =
        std::any_of(refined_patches_.begin(), refined_patches_.end(), [&](const Patch& p) {
          return std::hypot(p[0] - place[0], p[1] - place[1], p[2] - place[2]) <
                 0.15 * study_->scale;
        });
    if (known) continue;
    for (const double power : kRatioPowers) {
      const auto& [x, y, radius, ratio] = place;
      starts.push_back(bounded_patch({x, y, radius, std::pow(ratio, power)}, study_->scale));
    }
  }
  if (starts.empty()) return {};
  ++searches;
  auto simulated = simulated_discs(*predictor_, *study_, explained, starts);
  if (!simulated) return simulated.error();
  std::stable_sort(simulated->begin(), simulated->end(), better);
  for (const EffectCandidate& disc : *simulated) catalogue_.push_back(disc.signature);
  const EffectCandidate& best = simulated->front();
  if (best.gain + best.signature.penalty < kWorthRefining) return {};
  if (kMostOfMoving * best.gain < most_gain) return {};  // its turn comes when that is explained
  const bool behind = best.gain < most_gain;
  auto climbed = PatchClimb(*predictor_, *study_, explained).run(std::move(*simulated), behind);
  if (!climbed) return climbed.error();
  // What was left because something else explains more may be looked at again.
  if (!climbed->left) refined_patches_.push_back(patch_of(climbed->discs.front().signature));
  for (EffectCandidate& disc : climbed->discs) catalogue_.push_back(std::move(disc.signature));
  return {};
}

}  // namespace gapfarm
