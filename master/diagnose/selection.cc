#include "master/diagnose/selection.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "master/diagnose/aliases.h"
#include "master/diagnose/seam.h"
#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

constexpr double kWorthRefining = 8;         // nats before the penalty
constexpr double kWorthSketched = 12.5;      // of patches; where there are none it reaches 11
constexpr double kWorthRefiningShare = 0.3;  // of the best: no search of places makes up for less
constexpr double kSecondAlias = 0.8;   // cosine beyond which a further effect is the first again,
constexpr double kSecondShare = 0.25;  // unless it gains this share of all that is explained

// Effects whose difference is small beside what one contact model and another make of them: of
// these a second one must gain a good part of what the first did.
struct Family {
  std::set<std::string> effects;
  double share;
};
const Family kFamilies[] = {
    {{"motor_deadband", "rolling_resistance", "timing_offset", "motor_lag"}, 0.75},
    {{"floor_tilt", "floor_nap"}, 0.15},
};
constexpr int kSeamSteps = 10;
constexpr int kMostPatchSearches = 4;
constexpr double kWorthRelinearising = 40;  // nats: curvature of weaker effects is below the noise
constexpr int kMostRelinearised = 4;
constexpr std::size_t kOffered = 6;  // candidates kept of a step
Patch patch_of(const Signature& s) {
  return {s.fixed.at("friction_patch.x"), s.fixed.at("friction_patch.y"),
          s.fixed.at("friction_patch.radius"), s.fixed.at("friction_patch.ratio")};
}

double net_gain(const Regression& explained, const Signature& s) {
  return explained.gain(s.columns).squares / 2 - s.penalty;
}

double cosine(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const double lengths = a.norm() * b.norm();
  return lengths > 0 ? a.dot(b) / lengths : 0;
}

double total_gain(const std::vector<EffectCandidate>& chosen) {
  double sum = 0;
  for (const EffectCandidate& c : chosen) sum += c.gain;
  return sum;
}

std::set<std::string> names_of(const std::vector<EffectCandidate>& chosen,
                               std::size_t but = ~std::size_t{0}) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (i != but) names.insert(chosen[i].signature.effect);
  }
  return names;
}

}  // namespace

void Selector::look_for_patches(std::function<PatchSearch()> make) {
  make_patch_search_ = std::move(make);
  patch_search_ = make_patch_search_();
}

EffectCandidate Selector::refine_seam(const Regression& explained, EffectCandidate best) const {
  // The gain jumps as readings change sides, so everything near is tried.
  const int axis = static_cast<int>(best.signature.fixed.at("camera_seam.axis"));
  const double coarse = best.signature.fixed.at("camera_seam.position");
  for (int k = -kSeamSteps; k <= kSeamSteps; ++k) {
    Signature s = seam_signature(study_, axis, coarse + k * kSeamStep_m);
    study_.drop_ignored(s.columns);
    const double gain = net_gain(explained, s);
    if (gain > best.gain) best = {gain, std::move(s)};
  }
  return best;
}

// Simulates discs, in their order; they join the catalogue.
Result<std::vector<EffectCandidate>> Selector::simulate_patches(const Regression& explained,
                                                                const std::vector<Patch>& patches) {
  auto found = patch_signatures(predictor_, study_, patches);
  if (!found) return found.error();
  std::vector<EffectCandidate> simulated;
  for (Signature& s : *found) {
    study_.drop_ignored(s.columns);
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
  return refine_patch(explained, best);
}

Result<std::vector<EffectCandidate>> Selector::candidates(const Regression& explained,
                                                          const std::set<std::string>& without) {
  std::map<std::string, EffectCandidate> best;
  double most = 0;
  std::size_t seen = 0;
  const auto see_all = [&] {
    for (; seen < catalogue_.size(); ++seen) {
      const Signature& s = catalogue_[seen];
      if (without.count(s.effect)) continue;
      const double gain = net_gain(explained, s);
      most = std::max(most, gain);
      const auto [entry, fresh] = best.try_emplace(s.effect, EffectCandidate{gain, s});
      if (!fresh && gain > entry->second.gain) entry->second = {gain, s};
    }
  };
  see_all();
  if (!without.count("friction_patch")) {
    if (Status s = search_patches(explained, most); !s) return s.error();
    see_all();
  }
  for (auto& [effect, candidate] : best) {
    if (candidate.gain + candidate.signature.penalty < kWorthRefining) continue;
    if (candidate.gain < kWorthRefiningShare * most) continue;
    if (effect == "camera_seam") candidate = refine_seam(explained, candidate);
  }
  std::vector<EffectCandidate> sorted;
  for (auto& [effect, candidate] : best) sorted.push_back(std::move(candidate));
  std::stable_sort(
      sorted.begin(), sorted.end(),
      [](const EffectCandidate& a, const EffectCandidate& b) { return a.gain > b.gain; });
  return sorted;
}

Result<EffectCandidate> Selector::again(const Regression& explained, const std::string& effect) {
  std::set<std::string> others;
  for (const Signature& s : catalogue_) others.insert(s.effect);
  others.insert("friction_patch");  // joins the catalogue when it is looked for
  others.erase(effect);
  auto best = candidates(explained, others);
  if (!best) return best.error();
  return best->empty() ? EffectCandidate{} : std::move(best->front());
}

Regression Selector::with(const std::vector<const Signature*>& signatures) const {
  Regression r = base_;
  for (const Signature* s : signatures) r.add(s->columns);
  return r;
}

Regression Selector::without(const std::vector<Signature>& first,
                             const std::vector<EffectCandidate>& chosen,
                             std::size_t leave_out) const {
  std::vector<const Signature*> all;
  for (const Signature& s : first) all.push_back(&s);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (i != leave_out) all.push_back(&chosen[i].signature);
  }
  return with(all);
}

double Selector::alias_cosine(const std::vector<Signature>& first,
                              const std::vector<EffectCandidate>& chosen, std::size_t i,
                              const EffectCandidate& other) const {
  const Regression r = without(first, chosen, i);
  return cosine(r.explained(chosen[i].signature.columns), r.explained(other.signature.columns));
}

bool Selector::is_new(const std::vector<Signature>& first,
                      const std::vector<EffectCandidate>& chosen,
                      const EffectCandidate& candidate) const {
  for (const Family& family : kFamilies) {
    if (!family.effects.count(candidate.signature.effect)) continue;
    double gained = 0;
    for (const EffectCandidate& c : chosen) {
      if (family.effects.count(c.signature.effect)) gained += c.gain;
    }
    if (candidate.gain < family.share * gained) return false;
  }
  if (candidate.gain > kSecondShare * (first_gain_ + total_gain(chosen))) return true;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (alias_cosine(first, chosen, i, candidate) > kSecondAlias) return false;
  }
  return true;
}

void Selector::drop_weak(std::vector<EffectCandidate>* chosen) const {
  const double least =
      std::max(study_.subject->least_gain, kLeastShare * (first_gain_ + total_gain(*chosen)));
  std::erase_if(*chosen, [&](const EffectCandidate& c) { return c.gain <= least; });
}

// Lets every earlier choice be replaced in the light of the later ones, and drops what has become
// too weak.
Status Selector::replace_each(const std::vector<Signature>& first,
                              const std::set<std::string>& rejected,
                              std::vector<EffectCandidate>* chosen) {
  for (std::size_t i = 0; i < chosen->size(); ++i) {
    const Regression others = without(first, *chosen, i);
    std::set<std::string> not_these = names_of(*chosen, i);
    not_these.insert(rejected.begin(), rejected.end());
    auto better = candidates(others, not_these);
    if (!better) return better.error();
    EffectCandidate& own = (*chosen)[i];
    own.gain = net_gain(others, own.signature);
    if (!better->empty() && better->front().gain > own.gain) own = better->front();
  }
  drop_weak(chosen);
  return {};
}

// Small errors of a strong effect's linear signature look like other effects.
Status Selector::use_estimates(const std::vector<Signature>& first, const Relinearise& relinearise,
                               std::vector<EffectCandidate>* chosen) {
  if (total_gain(*chosen) < kWorthRelinearising || relinearised_ == kMostRelinearised) return {};
  ++relinearised_;
  auto at_estimate = relinearise(*chosen);
  if (!at_estimate) return at_estimate.error();
  if (at_estimate->columns.empty()) return {};  // cannot be simulated there
  base_.restart(at_estimate->data);
  for (std::size_t i = 0; i < chosen->size(); ++i) {
    (*chosen)[i].signature.columns = std::move(at_estimate->columns[i]);
  }
  for (std::size_t i = 0; i < chosen->size(); ++i) {
    (*chosen)[i].gain = net_gain(without(first, *chosen, i), (*chosen)[i].signature);
  }
  drop_weak(chosen);
  return {};
}

Result<std::vector<Alias>> Selector::aliases_of(const std::vector<Signature>& first,
                                                const std::vector<EffectCandidate>& chosen,
                                                std::size_t i) {
  const Regression r = without(first, chosen, i);
  const Eigen::VectorXd own = r.explained(chosen[i].signature.columns);
  auto others = candidates(r, names_of(chosen));
  if (!others) return others.error();
  std::vector<Alias> aliases;
  for (const EffectCandidate& other : *others) {
    const double parallel = cosine(own, r.explained(other.signature.columns));
    const bool as_good =
        chosen[i].gain - other.gain < 4 && other.gain > study_.subject->least_gain / 2;
    const auto& constant = constant_aliases(chosen[i].signature.effect);
    const bool always =
        std::find(constant.begin(), constant.end(), other.signature.effect) != constant.end();
    if (parallel > kAliasCosine || as_good || always)
      aliases.push_back({other.signature.effect, parallel});
    if (aliases.size() == 3) break;
  }
  return aliases;
}

void Selector::recount(const Regression& nuisances) {
  base_ = nuisances;
  if (make_patch_search_) patch_search_ = make_patch_search_();
  for (Signature& s : catalogue_) study_.drop_ignored(s.columns);
}

Result<std::vector<ChosenEffect>> Selector::select(const std::vector<Signature>& first,
                                                   double first_gain,
                                                   const Relinearise& relinearise) {
  first_gain_ = first_gain;
  relinearised_ = 0;
  steps_.clear();
  std::vector<EffectCandidate> chosen;
  std::set<std::string> taken;
  for (const Signature& s : first) taken.insert(s.effect);
  // Adding and dropping could go round for ever: whatever led to names that were there before is
  // not tried again.
  std::set<std::set<std::string>> seen;
  std::set<std::string> rejected;
  while (chosen.size() < kMostEffects) {
    seen.insert(names_of(chosen));
    std::set<std::string> used = names_of(chosen);
    used.insert(taken.begin(), taken.end());
    auto next = candidates(without(first, chosen, ~std::size_t{0}), used);
    if (!next) return next.error();
    SelectionStep step;
    step.explained.assign(used.begin(), used.end());
    for (std::size_t i = 0; i < std::min(kOffered, next->size()); ++i) {
      step.offered.emplace_back((*next)[i].signature.effect, (*next)[i].gain);
    }
    steps_.push_back(std::move(step));
    std::erase_if(*next, [&](const EffectCandidate& c) {
      return c.gain < study_.subject->least_gain || rejected.count(c.signature.effect) ||
             !is_new(first, chosen, c);
    });
    const double least = kLeastShare * (first_gain + total_gain(chosen));
    if (next->empty() || next->front().gain < least) break;
    const std::string added = next->front().signature.effect;
    chosen.push_back(next->front());
    if (chosen.size() > 1) {
      if (Status s = replace_each(first, rejected, &chosen); !s) return s.error();
    }
    if (Status s = use_estimates(first, relinearise, &chosen); !s) return s.error();
    if (seen.count(names_of(chosen))) rejected.insert(added);
  }
  std::stable_sort(
      chosen.begin(), chosen.end(),
      [](const EffectCandidate& a, const EffectCandidate& b) { return a.gain > b.gain; });
  std::vector<ChosenEffect> effects;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    auto aliases = aliases_of(first, chosen, i);
    if (!aliases) return aliases.error();
    effects.push_back({chosen[i], std::move(*aliases)});
  }
  return effects;
}

}  // namespace gapfarm
