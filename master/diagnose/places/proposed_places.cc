// What has a place and is searched rather than sloped: patches of floor and seams.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "master/diagnose/fit/proposals.h"
#include "master/diagnose/fit/signatures.h"
#include "master/diagnose/places/seam.h"
#include "master/diagnose/subject.h"
#include "master/infer/settings.h"

namespace gapfarm {
namespace {

constexpr int kSeamSteps = 10;
constexpr double kWorthRefiningShare = 0.5;  // of the best line's gain
// One that can be simulated and distinguished from none.
constexpr double kLeastRadius_m = 0.05, kLeastRatio = 0.06, kMostRatio = 2.9;
// The ratio is what the sketch is least sure of.
constexpr std::array<double, 3> kRatioPowers = {0.5, 1, 2};

Patch bounded_patch(Patch patch, double scale) {
  patch[2] = std::max(patch[2], kLeastRadius_m * scale);
  patch[3] = std::clamp(patch[3], kLeastRatio, kMostRatio);
  return patch;
}

}  // namespace

double net_gain(const Regression& explained, const Signature& s) {
  const bool one = s.whole && s.columns.cols() == 1;
  const double squares =
      one ? explained.gain_within(s.columns.col(0), 1 / kMostOfItself, kMostOfItself)
          : explained.gain(s.columns).squares;
  return squares / 2 - s.penalty;
}

void Proposals::look_for_patches() {
  patch_search_ = study_->subject->patches(*predictor_, *study_);
}

EffectCandidate Proposals::refine_seam(const Regression& explained,
                                       const std::vector<EffectCandidate>& lines,
                                       EffectCandidate best) const {
  // The gain jumps as readings change sides, so everything near is tried; the best line may lie
  // between two that are not.
  const double worth = kWorthRefiningShare * best.gain;
  for (const EffectCandidate& line : lines) {
    if (line.gain < worth) continue;
    const int axis = static_cast<int>(line.signature.fixed.at("camera_seam.axis"));
    const double coarse = line.signature.fixed.at("camera_seam.position");
    for (int k = -kSeamSteps; k <= kSeamSteps; ++k) {
      Signature s = seam_signature(*study_, axis, coarse + k * kSeamStep_m);
      study_->drop_ignored(s.columns);
      const double gain = net_gain(explained, s);
      if (gain > best.gain) best = {gain, std::move(s)};
    }
  }
  return best;
}

// A line near the edge of where trials were bends all that lies beyond it, a lens whose middle is
// far away all that it sees.
void Proposals::drop_linear_views(const Regression& explained,
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

// What the sketch finds in the data that are left, simulated; `beside`: another one than this.
Result<std::vector<Signature>> Proposals::patches(const Regression& explained, double most_gain,
                                                  const std::optional<Patch>& beside) const {
  if (predictor_->excluded().count(kPatchEffect) > 0) return std::vector<Signature>();
  const double worth =
      std::max(beside ? kLeastSecondOfAKind : kWorthSketched, kWorthSearchingShare * most_gain);
  ASSIGN_OR_RETURN(const auto places, patch_search_(explained, {kFinalists, 2 * worth, beside}));
  std::vector<Patch> discs;
  for (const auto& [x, y, radius, ratio] : places) {
    for (const double power : kRatioPowers) {
      discs.push_back(bounded_patch({x, y, radius, std::pow(ratio, power)}, study_->scale));
    }
  }
  if (discs.empty()) return std::vector<Signature>();
  auto simulated = patch_signatures(*predictor_, *study_, discs);
  if (!simulated) return simulated;
  for (Signature& s : *simulated) study_->drop_ignored(s.columns);
  return simulated;
}

}  // namespace gapfarm
