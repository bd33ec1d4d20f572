#include "master/diagnose/places/patch_climb.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <utility>

#include "master/diagnose/places/patch_places.h"

namespace gapfarm {
namespace {

// Moves: standard deviations at first, for an SRV-1, and how they go on.
constexpr PatchStep kFirstStep = {0.05, 0.4};
constexpr double kStepsShrink = 0.7, kLeastRadius_m = 0.05;
constexpr double kLeastMovedRatio = 0.06, kMostMovedRatio = 2.9;
constexpr double kClimbing = 1.03;  // times the gain of before
constexpr int kMoves = 6;
constexpr std::size_t kMostParents = 3, kOffspring = 12;
constexpr std::size_t kFinalists = 4;  // of them
constexpr std::uint64_t kMovesSeed = 4;

bool gains_more(const EffectCandidate& a, const EffectCandidate& b) { return a.gain > b.gain; }

std::vector<Patch> patches_of(const std::vector<EffectCandidate>& discs) {
  std::vector<Patch> patches;
  for (const EffectCandidate& disc : discs) patches.push_back(patch_of(disc.signature));
  return patches;
}

}  // namespace

Patch bounded_patch(Patch patch, double scale) {
  patch[2] = std::max(patch[2], kLeastRadius_m * scale);
  patch[3] = std::clamp(patch[3], kLeastMovedRatio, kMostMovedRatio);
  return patch;
}

Result<std::vector<EffectCandidate>> simulated_discs(Predictor& predictor, const Study& study,
                                                     const Regression& explained,
                                                     const std::vector<Patch>& patches,
                                                     const PatchTrials& trials) {
  auto found = patch_signatures(predictor, study, patches, trials);
  if (!found) return found.error();
  std::vector<EffectCandidate> simulated;
  for (Signature& s : *found) {
    study.drop_ignored(s.columns);
    const double gain = net_gain(explained, s);
    simulated.push_back({gain, std::move(s)});
  }
  return simulated;
}

PatchClimb::PatchClimb(Predictor& predictor, const Study& study, const Regression& explained)
    : predictor_(&predictor),
      study_(&study),
      explained_(&explained),
      stream_({kMovesSeed, Purpose::kStatistics, 0, 0, 0}) {
  for (std::size_t i = 0; i < study.size(); ++i) first_heat_.push_back(stream_.bernoulli(0.5));
}

PatchTrials PatchClimb::heat(bool first) const {
  return [this, first](std::size_t trial, PatchReach reach) {
    return reach == PatchReach::kRim && first_heat_[trial] == first;
  };
}

std::vector<Patch> PatchClimb::moved(const std::vector<EffectCandidate>& discs,
                                     const PatchStep& step) {
  std::vector<Patch> moved;
  for (std::size_t i = 0; i < kOffspring; ++i) {
    Patch to = patch_of(discs[i % discs.size()].signature);
    for (std::size_t c = 0; c < 3; ++c) to[c] += step.length_m * stream_.normal();
    to[3] *= std::exp(step.log_ratio * stream_.normal());
    moved.push_back(bounded_patch(to, study_->scale));
  }
  return moved;
}

Eigen::VectorXd PatchClimb::in_first_heat(Eigen::VectorXd mark) const {
  for (std::size_t i = 0; i < first_heat_.size(); ++i) {
    if (!first_heat_[i]) mark.segment<3>(static_cast<Eigen::Index>(3 * i)).setZero();
  }
  return mark;
}

void PatchClimb::remember(const std::vector<EffectCandidate>& discs) {
  for (const EffectCandidate& disc : discs) {
    if (disc.signature.columns.isZero(0)) continue;  // it could not be simulated
    marked_.push_back({patch_of(disc.signature), in_first_heat(disc.signature.columns.col(0))});
  }
}

// The best of many, in both heats.
Result<std::vector<EffectCandidate>> PatchClimb::race(const std::vector<Patch>& patches) {
  auto racing = simulated_discs(*predictor_, *study_, *explained_, patches, heat(true));
  if (!racing) return racing;
  remember(*racing);
  std::stable_sort(racing->begin(), racing->end(), gains_more);
  racing->resize(std::min(racing->size(), kFinalists));
  const auto rest =
      simulated_discs(*predictor_, *study_, *explained_, patches_of(*racing), heat(false));
  if (!rest) return rest.error();
  for (std::size_t i = 0; i < racing->size(); ++i) {
    EffectCandidate& disc = (*racing)[i];
    disc.signature.columns += (*rest)[i].signature.columns;
    disc.gain = net_gain(*explained_, disc.signature);
  }
  return racing;
}

// Where the discs near the leader lead, and half way there.
Result<std::vector<EffectCandidate>> PatchClimb::follow(const EffectCandidate& leader,
                                                        const PatchStep& step) {
  const Patch from = patch_of(leader.signature);
  const auto to = linear_best({from, in_first_heat(leader.signature.columns.col(0))}, marked_,
                              in_first_heat(explained_->left()), step);
  if (!to) return std::vector<EffectCandidate>{};
  Patch half_way = from;
  for (std::size_t c = 0; c < 3; ++c) half_way[c] = (from[c] + (*to)[c]) / 2;
  half_way[3] = std::sqrt(from[3] * (*to)[3]);
  auto led =
      simulated_discs(*predictor_, *study_, *explained_,
                      {bounded_patch(*to, study_->scale), bounded_patch(half_way, study_->scale)},
                      [](std::size_t, PatchReach reach) { return reach == PatchReach::kRim; });
  if (led) remember(*led);
  return led;
}

Result<PatchClimb::Climbed> PatchClimb::run(std::vector<EffectCandidate> discs, bool behind) {
  remember(discs);
  bool left = false;
  PatchStep step = {kFirstStep.length_m * study_->scale, kFirstStep.log_ratio};
  for (int k = 0; k < kMoves && !left; ++k) {
    const double before = discs.front().gain;
    discs.resize(std::min(discs.size(), kMostParents));
    auto raced = race(moved(discs, step));
    if (!raced) return raced.error();
    std::move(raced->begin(), raced->end(), std::back_inserter(discs));
    std::stable_sort(discs.begin(), discs.end(), gains_more);
    auto led = follow(discs.front(), step);
    if (!led) return led.error();
    std::move(led->begin(), led->end(), std::back_inserter(discs));
    std::stable_sort(discs.begin(), discs.end(), gains_more);
    left = behind && !(discs.front().gain > kClimbing * before);
    step.length_m *= kStepsShrink;
    step.log_ratio *= kStepsShrink;
  }
  discs.resize(std::min(discs.size(), kMostParents));
  auto whole = simulated_discs(*predictor_, *study_, *explained_, patches_of(discs));
  if (!whole) return whole.error();
  return Climbed{std::move(*whole), left};
}

}  // namespace gapfarm
