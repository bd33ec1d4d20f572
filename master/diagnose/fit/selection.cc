#include "master/diagnose/fit/selection.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "common/effects/catalogue.h"
#include "master/diagnose/places/patch_places.h"
#include "master/diagnose/places/seam.h"
#include "master/diagnose/subject.h"

namespace gapfarm {
namespace {

constexpr double kSecondAlias = 0.8;   // cosine beyond which a further effect is the first again,
constexpr double kSecondShare = 0.25;  // unless it gains this share of all that is explained

// A second one of a kind, for an error of the first's place or bend looks like one: of all that is
// explained.
constexpr double kSecondOfAKindShare = 0.05;
constexpr double kWorthRelinearising = 40;  // nats: curvature of weaker effects is below the noise
constexpr int kMostRelinearised = 4;
constexpr std::size_t kOffered = 6;  // candidates kept of a step

double cosine(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const double lengths = a.norm() * b.norm();
  return lengths > 0 ? a.dot(b) / lengths : 0;
}

double total_gain(const std::vector<EffectCandidate>& chosen) {
  double sum = 0;
  for (const EffectCandidate& c : chosen) sum += c.gain;
  return sum;
}

bool is_second(const EffectCandidate& c) {
  return kind_of(c.signature.effect) != c.signature.effect;
}

// Gain below which an effect is not taken, where so much is explained.
double least_gain_of(const EffectCandidate& c, const Study& study, double explained) {
  if (is_second(c)) return std::max(kLeastSecondOfAKind, kSecondOfAKindShare * explained);
  return std::max(study.subject->least_gain, kLeastShare * explained);
}

// The second one of a kind whose first has gone is the first now.
void promote_seconds(std::vector<EffectCandidate>* chosen) {
  for (EffectCandidate& c : *chosen) {
    const std::string kind = kind_of(c.signature.effect);
    const bool first_there =
        std::any_of(chosen->begin(), chosen->end(),
                    [&](const EffectCandidate& o) { return o.signature.effect == kind; });
    if (!first_there) c.signature = renamed(std::move(c.signature), kind);
  }
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

// Whether there may be one in the table, and it is none that is there or omitted.
bool Selector::may_be_second(const std::string& second,
                             const std::set<std::string>& without) const {
  const std::span<const Effect> known = study_->table->effects();
  return !without.count(second) && !excluded_.count(second) &&
         std::any_of(known.begin(), known.end(), [&](const Effect& e) { return e.name == second; });
}

// Empty: not at all.
std::string Selector::offered_as(const Signature& s, const std::set<std::string>& without,
                                 const std::vector<EffectCandidate>& beside) const {
  if (!without.count(s.effect)) return s.effect;
  const std::string second = second_of(s.effect);
  const auto are_two = study_->subject->effects->row(s.effect).are_two;
  if (second.empty() || are_two == nullptr || !may_be_second(second, without)) return "";
  for (const EffectCandidate& first : beside) {
    if (first.signature.effect == s.effect && are_two(first.signature, s)) return second;
  }
  return "";
}

// Beside which a second one is to be looked for; none: it is not.
std::optional<Patch> Selector::first_patch(const std::set<std::string>& without,
                                           const std::vector<EffectCandidate>& beside) const {
  if (!without.count(kPatchEffect) || !may_be_second(second_of(kPatchEffect), without)) return {};
  for (const EffectCandidate& first : beside) {
    if (first.signature.effect == kPatchEffect) return patch_of(first.signature);
  }
  return {};
}

Result<std::vector<EffectCandidate>> Selector::candidates(
    const Regression& explained, const std::set<std::string>& without,
    const std::vector<EffectCandidate>& beside) {
  std::map<std::string, EffectCandidate> best;
  double most = 0;
  std::size_t seen = 0;
  const auto see_all = [&] {
    for (; seen < catalogue_.size(); ++seen) {
      const Signature& s = catalogue_[seen];
      const std::string name = offered_as(s, without, beside);
      if (name.empty()) continue;
      const double gain = net_gain(explained, s);
      most = std::max(most, gain);
      const auto [entry, fresh] = best.try_emplace(name, EffectCandidate{gain, s});
      if (!fresh && gain > entry->second.gain) entry->second = {gain, s};
    }
  };
  see_all();
  const std::optional<Patch> first = first_patch(without, beside);
  if (first || !without.count(kPatchEffect)) {
    if (Status s = search_patches(explained, most, first); !s) return s.error();
    see_all();
  }
  for (auto& [effect, candidate] : best) {
    if (candidate.gain + candidate.signature.penalty < kWorthRefining) continue;
    if (candidate.gain < kWorthRefiningShare * most) continue;
    if (is_seam(effect)) candidate = refine_seam(explained, candidate);
  }
  drop_linear_views(explained, &best);
  for (auto& [effect, candidate] : best) {
    if (candidate.signature.effect != effect)
      candidate.signature = renamed(std::move(candidate.signature), effect);
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
  others.insert(kPatchEffect);  // joins the catalogue when it is looked for
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
                             std::size_t exclude) const {
  std::vector<const Signature*> all;
  for (const Signature& s : first) all.push_back(&s);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (i != exclude) all.push_back(&chosen[i].signature);
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
  const EffectDiagnoses& effects = *study_->subject->effects;
  const EffectFamily* family = effects.row(candidate.signature.effect).family;
  if (family != nullptr) {
    double gained = 0;
    for (const EffectCandidate& c : chosen) {
      if (effects.row(c.signature.effect).family == family) gained += c.gain;
    }
    if (candidate.gain < family->share * gained) return false;
  }
  if (candidate.gain > kSecondShare * (first_gain_ + total_gain(chosen))) return true;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (alias_cosine(first, chosen, i, candidate) > kSecondAlias) return false;
  }
  return true;
}

void Selector::drop_weak(std::vector<EffectCandidate>* chosen) const {
  const double explained = first_gain_ + total_gain(*chosen);
  std::erase_if(*chosen, [&](const EffectCandidate& c) {
    return c.gain <= least_gain_of(c, *study_, explained);
  });
  promote_seconds(chosen);
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
    std::vector<EffectCandidate> beside = *chosen;
    beside.erase(beside.begin() + static_cast<std::ptrdiff_t>(i));
    auto better = candidates(others, not_these, beside);
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
        chosen[i].gain - other.gain < 4 && other.gain > study_->subject->least_gain / 2;
    const auto& constant = study_->subject->effects->row(chosen[i].signature.effect).aliases;
    const bool always =
        std::find(constant.begin(), constant.end(), other.signature.effect) != constant.end();
    if (parallel > kAliasCosine || as_good || always)
      aliases.push_back({other.signature.effect, parallel});
    if (aliases.size() == 3) break;
  }
  return aliases;
}

void Selector::recount(const Study& study, const Regression& nuisances) {
  study_ = &study;
  base_ = nuisances;
  if (patch_search_) look_for_patches();
  for (Signature& s : catalogue_) study_->drop_ignored(s.columns);
}

Result<std::vector<ChosenEffect>> Selector::select(const std::vector<Signature>& first,
                                                   double first_gain,
                                                   const Relinearise& relinearise,
                                                   std::size_t most) {
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
  while (chosen.size() < most) {
    seen.insert(names_of(chosen));
    std::set<std::string> used = names_of(chosen);
    used.insert(taken.begin(), taken.end());
    auto next = candidates(without(first, chosen, ~std::size_t{0}), used, chosen);
    if (!next) return next.error();
    SelectionStep step;
    step.explained.assign(used.begin(), used.end());
    for (std::size_t i = 0; i < std::min(kOffered, next->size()); ++i) {
      step.offered.emplace_back((*next)[i].signature.effect, (*next)[i].gain);
    }
    steps_.push_back(std::move(step));
    const double explained = first_gain + total_gain(chosen);
    std::erase_if(*next, [&](const EffectCandidate& c) {
      return c.gain < least_gain_of(c, *study_, explained) || rejected.count(c.signature.effect) ||
             !is_new(first, chosen, c);
    });
    if (next->empty()) break;
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
