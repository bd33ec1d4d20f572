#include "master/diagnose/selection.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

namespace gapfarm {
namespace {

constexpr double kWorthRefining = 8;         // nats before the penalty
constexpr double kWorthRefiningShare = 0.3;  // of the best: no search of places makes up for less
constexpr double kSecondAlias = 0.8;   // cosine beyond which a further effect is the first again,
constexpr double kSecondShare = 0.25;  // unless it gains this share of all that is explained

// Effects that change how far a command drives, whatever else: of these a second one must gain a
// good part of what the first did.
const std::set<std::string> kReach = {"motor_deadband", "rolling_resistance", "timing_offset",
                                      "motor_lag"};
constexpr double kReachShare = 0.4;
// Turn alike in any data of rest poses.
constexpr std::pair<const char*, const char*> kAlwaysAliases[] = {
    {"motor_deadband", "rolling_resistance"}, {"com_offset", "marker_offset"}};

bool always_aliases(const std::string& a, const std::string& b) {
  return std::any_of(std::begin(kAlwaysAliases), std::end(kAlwaysAliases), [&](const auto& pair) {
    return (a == pair.first && b == pair.second) || (a == pair.second && b == pair.first);
  });
}

double net_gain(const Regression& explained, const Signature& s) {
  return explained.gain(s.columns).squares / 2 - s.penalty;
}

double cosine(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const double lengths = a.norm() * b.norm();
  return lengths > 0 ? a.dot(b) / lengths : 0;
}

double total_gain(const std::vector<Candidate>& chosen) {
  double sum = 0;
  for (const Candidate& c : chosen) sum += c.gain;
  return sum;
}

std::set<std::string> names_of(const std::vector<Candidate>& chosen,
                               std::size_t but = ~std::size_t{0}) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (i != but) names.insert(chosen[i].signature.effect);
  }
  return names;
}

}  // namespace

Status Selector::add_patches() {
  double low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
  for (const ResidualTrial& t : study_.trials) {
    low[0] = std::min(low[0], t.X_WS.x), high[0] = std::max(high[0], t.X_WS.x);
    low[1] = std::min(low[1], t.X_WS.y), high[1] = std::max(high[1], t.X_WS.y);
  }
  std::vector<std::array<double, 4>> places;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      places.push_back({low[0] + (high[0] - low[0]) * (2 * i + 1) / 8,
                        low[1] + (high[1] - low[1]) * (2 * j + 1) / 8,
                        0.28 * std::max(high[0] - low[0], high[1] - low[1]), 0.7});
    }
  }
  auto patches = patch_signatures(predictor_, study_, places);
  if (!patches) return patches.error();
  catalogue_.insert(catalogue_.end(), patches->begin(), patches->end());
  return {};
}

Candidate Selector::refine_seam(const Regression& explained, Candidate best) const {
  const int axis = static_cast<int>(best.signature.fixed.at("camera_seam.axis"));
  for (double step : {0.02, 0.01, 0.005}) {
    const double position = best.signature.fixed.at("camera_seam.position");
    for (double sign : {-1.0, 1.0}) {
      Signature s = seam_signature(study_, axis, position + sign * step);
      const double gain = net_gain(explained, s);
      if (gain > best.gain) best = {gain, std::move(s)};
    }
  }
  return best;
}

Result<Candidate> Selector::refine_patch(const Regression& explained, Candidate best) {
  const auto place = [](const Signature& s) {
    return std::array<double, 4>{s.fixed.at("friction_patch.x"), s.fixed.at("friction_patch.y"),
                                 s.fixed.at("friction_patch.radius"),
                                 s.fixed.at("friction_patch.ratio")};
  };
  const auto look = [&](const std::vector<std::array<double, 4>>& places) -> Status {
    auto found = patch_signatures(predictor_, study_, places);
    if (!found) return found.error();
    for (Signature& s : *found) {
      const double gain = net_gain(explained, s);
      if (gain > best.gain) best = {gain, std::move(s)};
    }
    return {};
  };
  const std::array<double, 4> coarse = place(best.signature);
  std::vector<std::array<double, 4>> ratios;
  for (double ratio : {0.15, 0.4, 1.8}) ratios.push_back({coarse[0], coarse[1], coarse[2], ratio});
  if (Status s = look(ratios); !s) return s.error();
  for (double step : {0.15, 0.07, 0.03}) {
    const auto [x, y, r, q] = place(best.signature);
    const Status s = look({{x + step, y, r, q},
                           {x - step, y, r, q},
                           {x, y + step, r, q},
                           {x, y - step, r, q},
                           {x, y, r + step, q},
                           {x, y, std::max(0.1, r - step), q},
                           {x, y, r, std::min(2.9, q * (1 + 4 * step))},
                           {x, y, r, std::max(0.06, q / (1 + 4 * step))}});
    if (!s) return s.error();
  }
  return best;
}

Result<std::vector<Candidate>> Selector::candidates(const Regression& explained,
                                                    const std::set<std::string>& without) {
  std::map<std::string, Candidate> best;
  for (const Signature& s : catalogue_) {
    if (without.count(s.effect)) continue;
    const double gain = net_gain(explained, s);
    const auto [entry, fresh] = best.try_emplace(s.effect, Candidate{gain, s});
    if (!fresh && gain > entry->second.gain) entry->second = {gain, s};
  }
  double most = 0;
  for (const auto& [effect, candidate] : best) most = std::max(most, candidate.gain);
  for (auto& [effect, candidate] : best) {
    if (candidate.gain + candidate.signature.penalty < kWorthRefining) continue;
    if (candidate.gain < kWorthRefiningShare * most) continue;
    if (effect == "camera_seam") candidate = refine_seam(explained, candidate);
    if (effect == "friction_patch") {
      auto refined = refine_patch(explained, candidate);
      if (!refined) return refined.error();
      candidate = *refined;
    }
  }
  std::vector<Candidate> sorted;
  for (auto& [effect, candidate] : best) sorted.push_back(std::move(candidate));
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Candidate& a, const Candidate& b) { return a.gain > b.gain; });
  return sorted;
}

Regression Selector::with(const std::vector<const Signature*>& signatures) const {
  Regression r = base_;
  for (const Signature* s : signatures) r.add(s->columns);
  return r;
}

Regression Selector::without(const std::vector<Signature>& first,
                             const std::vector<Candidate>& chosen, std::size_t leave_out) const {
  std::vector<const Signature*> all;
  for (const Signature& s : first) all.push_back(&s);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (i != leave_out) all.push_back(&chosen[i].signature);
  }
  return with(all);
}

double Selector::alias_cosine(const std::vector<Signature>& first,
                              const std::vector<Candidate>& chosen, std::size_t i,
                              const Candidate& other) const {
  const Regression r = without(first, chosen, i);
  return cosine(r.explained(chosen[i].signature.columns), r.explained(other.signature.columns));
}

bool Selector::is_new(const std::vector<Signature>& first, const std::vector<Candidate>& chosen,
                      const Candidate& candidate) const {
  for (const Candidate& c : chosen) {
    const bool both = kReach.count(c.signature.effect) && kReach.count(candidate.signature.effect);
    if (both && candidate.gain < kReachShare * c.gain) return false;
  }
  if (candidate.gain > kSecondShare * total_gain(chosen)) return true;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (alias_cosine(first, chosen, i, candidate) > kSecondAlias) return false;
  }
  return true;
}

// Lets every earlier choice be replaced in the light of the later ones, and drops what has become
// too weak.
Status Selector::replace_each(const std::vector<Signature>& first, std::vector<Candidate>* chosen) {
  for (std::size_t i = 0; i < chosen->size(); ++i) {
    auto better = candidates(without(first, *chosen, i), names_of(*chosen, i));
    if (!better) return better.error();
    if (!better->empty()) (*chosen)[i] = better->front();
  }
  const double least = std::max(kLeastGain, kLeastShare * total_gain(*chosen));
  std::erase_if(*chosen, [&](const Candidate& c) { return c.gain <= least; });
  return {};
}

Result<std::vector<Alias>> Selector::aliases_of(const std::vector<Signature>& first,
                                                const std::vector<Candidate>& chosen,
                                                std::size_t i) {
  const Regression r = without(first, chosen, i);
  const Eigen::VectorXd own = r.explained(chosen[i].signature.columns);
  auto others = candidates(r, names_of(chosen));
  if (!others) return others.error();
  std::vector<Alias> aliases;
  for (const Candidate& other : *others) {
    const double parallel = cosine(own, r.explained(other.signature.columns));
    const bool as_good = chosen[i].gain - other.gain < 4 && other.gain > kLeastGain / 2;
    const bool always =
        always_aliases(chosen[i].signature.effect, other.signature.effect) && parallel > 0.3;
    if (parallel > kAliasCosine || as_good || always)
      aliases.push_back({other.signature.effect, parallel});
    if (aliases.size() == 3) break;
  }
  return aliases;
}

Result<std::vector<ChosenEffect>> Selector::select(const std::vector<Signature>& first) {
  std::vector<Candidate> chosen;
  std::set<std::string> taken;
  for (const Signature& s : first) taken.insert(s.effect);
  while (chosen.size() < kMostEffects) {
    std::set<std::string> used = names_of(chosen);
    used.insert(taken.begin(), taken.end());
    auto next = candidates(without(first, chosen, ~std::size_t{0}), used);
    if (!next) return next.error();
    std::erase_if(*next, [&](const Candidate& c) {
      return c.gain < kLeastGain || !is_new(first, chosen, c);
    });
    if (next->empty() || next->front().gain < kLeastShare * total_gain(chosen)) break;
    const std::size_t before = chosen.size();
    chosen.push_back(next->front());
    if (chosen.size() == 1) continue;
    if (Status s = replace_each(first, &chosen); !s) return s.error();
    if (chosen.size() <= before) break;
  }
  std::vector<ChosenEffect> effects;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    auto aliases = aliases_of(first, chosen, i);
    if (!aliases) return aliases.error();
    effects.push_back({chosen[i], std::move(*aliases)});
  }
  return effects;
}

}  // namespace gapfarm
