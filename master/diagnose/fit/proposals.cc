#include "master/diagnose/fit/proposals.h"

#include <algorithm>

#include "common/base/ranges.h"
#include "common/effects/catalogue.h"
#include "master/diagnose/places/seam.h"
#include "master/diagnose/subject.h"
#include "master/infer/settings.h"

namespace gapfarm {

double least_gain_of(const std::string& effect, const Study& study, double explained) {
  if (kind_of(effect) != effect) {
    return std::max(kLeastSecondOfAKind, kSecondOfAKindShare * explained);
  }
  return std::max(study.subject->least_gain, kLeastShare * explained);
}

// Whether there may be one in the table, and it is none that is there or omitted.
bool Proposals::may_be_second(const std::string& second,
                              const std::set<std::string>& without) const {
  return !without.count(second) && !excluded_.count(second) &&
         contains(study_->table->effects(), second, &Effect::name);
}

// Empty: not at all.
std::string Proposals::offered_as(const Signature& s, const std::set<std::string>& without,
                                  const std::vector<EffectCandidate>& beside) const {
  if (!without.count(s.effect)) return s.effect;
  const std::string second = second_of(s.effect);
  const auto are_two = study_->subject->effects->row(s.effect).are_two;
  if (second.empty() || are_two == nullptr || !may_be_second(second, without)) return "";
  for (const EffectCandidate& first : beside) {
    if (first.effect() == s.effect && are_two(first.signature, s)) return second;
  }
  return "";
}

// Beside which a second one is to be looked for; none: it is not.
std::optional<Patch> Proposals::first_patch(const std::set<std::string>& without,
                                            const std::vector<EffectCandidate>& beside) const {
  if (!without.count(kPatchEffect) || !may_be_second(second_of(kPatchEffect), without)) return {};
  for (const EffectCandidate& first : beside) {
    if (first.effect() == kPatchEffect) return patch_of(first.signature);
  }
  return {};
}

Result<std::vector<EffectCandidate>> Proposals::candidates(
    const Regression& explained, const std::set<std::string>& without,
    const std::vector<EffectCandidate>& beside) const {
  std::map<std::string, EffectCandidate> best;
  std::map<std::string, std::vector<EffectCandidate>> lines;  // of seams
  double most = 0;
  const auto see = [&](const std::vector<Signature>& signatures) {
    for (const Signature& s : signatures) {
      const std::string name = offered_as(s, without, beside);
      if (name.empty()) continue;
      const double gain = net_gain(explained, s);
      most = std::max(most, gain);
      if (is_seam(name)) lines[name].push_back({gain, s});
      const auto [entry, fresh] = best.try_emplace(name, EffectCandidate{gain, s});
      if (!fresh && gain > entry->second.gain) entry->second = {gain, s};
    }
  };
  see(catalogue_);
  const std::optional<Patch> first = first_patch(without, beside);
  if (patch_search_ && (first || !without.count(kPatchEffect))) {
    ASSIGN_OR_RETURN(const auto discs, patches(explained, most, first));
    see(discs);
  }
  for (auto& [effect, candidate] : best) {
    if (candidate.gain + candidate.signature.penalty < kWorthSearching) continue;
    if (candidate.gain < kWorthSearchingShare * most) continue;
    if (is_seam(effect)) candidate = refine_seam(explained, lines[effect], candidate);
  }
  drop_linear_views(explained, &best);
  for (auto& [effect, candidate] : best) {
    if (candidate.effect() != effect)
      candidate.signature = renamed(std::move(candidate.signature), effect);
  }
  std::vector<EffectCandidate> sorted;
  for (auto& [effect, candidate] : best) sorted.push_back(std::move(candidate));
  std::ranges::stable_sort(sorted, std::ranges::greater{}, &EffectCandidate::gain);
  return sorted;
}

Result<EffectCandidate> Proposals::again(const Regression& explained,
                                         const std::string& effect) const {
  std::set<std::string> others;
  for (const Signature& s : catalogue_) others.insert(s.effect);
  others.insert(kPatchEffect);  // joins the catalogue when it is looked for
  others.erase(effect);
  ASSIGN_OR_RETURN(auto best, candidates(explained, others));
  return best.empty() ? EffectCandidate{} : std::move(best.front());
}

Regression Proposals::with(const std::vector<Signature>& first,
                           const std::vector<EffectCandidate>& chosen,
                           std::optional<std::size_t> but) const {
  Regression r = base_;
  for (const Signature& s : first) r.add(s.columns);
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    if (k != but) r.add(chosen[k].signature.columns);
  }
  return r;
}

}  // namespace gapfarm
