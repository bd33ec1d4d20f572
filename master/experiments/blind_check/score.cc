#include "master/experiments/blind_check/score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "common/base/text.h"
#include "common/json/json.h"
#include "master/diagnose/effect_diagnosis.h"

namespace gapfarm {
namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

double number_at(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : kAbsent;
}

ReportedEffect reported_effect(const Json& json) {
  ReportedEffect effect;
  effect.name = json["name"].get<std::string>();
  const Json aliases = json.value("aliases", Json::array());
  for (const Json& alias : aliases) {
    if (alias.is_string()) effect.aliases.push_back(alias.get<std::string>());
  }
  effect.confidence = number_at(json, "confidence");
  effect.closed = number_at(json, "closed");
  const Json parameters = json.value("parameters", Json::object());
  if (!parameters.is_object()) return effect;
  for (const auto& [key, value] : parameters.items()) {
    if (!value.is_object()) continue;
    const ReportedParameter p{key,
                              number_at(value, "value"),
                              number_at(value, "lo"),
                              number_at(value, "hi"),
                              number_at(value, "sd"),
                              number_at(value, "bound")};
    if (std::isfinite(p.lo) && std::isfinite(p.hi)) effect.parameters.push_back(p);
  }
  return effect;
}

using Family = std::set<std::string>;

Family family_of(const ReportedEffect& effect) {
  Family family = {effect.name};
  const std::size_t count = std::min(effect.aliases.size(), kMaxAliases);
  family.insert(effect.aliases.begin(), effect.aliases.begin() + static_cast<long>(count));
  return family;
}

std::string names_of(const Reported& reported) {
  std::string text = joined(reported.effects, "+", &ReportedEffect::name);
  return text.empty() ? reported.verdict : reported.verdict + " " + text;
}

std::string names_of(const Truth& truth) { return joined(truth.effects, "+", &TrueEffect::name); }

Judgement judge_effects(const Truth& truth, const Reported& reported) {
  const std::string what = names_of(truth);
  if (reported.verdict != "effect" && reported.verdict != "effect+unknown") {
    return {false, what + "; reported " + reported.verdict};
  }
  std::vector<ReportedEffect> left = reported.effects;
  // By name first: one name may be another one's alias, and be there beside it.
  const auto hit_by = [&](const TrueEffect& effect, bool by_alias) {
    return std::ranges::find_if(left, [&](const ReportedEffect& one) {
      return by_alias ? family_of(one).count(effect.name) > 0 : one.name == effect.name;
    });
  };
  std::vector<TrueEffect> others;
  for (const TrueEffect& effect : truth.effects) {
    const auto hit = hit_by(effect, false);
    if (hit == left.end()) others.push_back(effect);
    if (hit != left.end()) left.erase(hit);
  }
  for (const TrueEffect& effect : others) {
    const auto hit = hit_by(effect, true);
    if (hit == left.end()) {
      return {false, what + "; missed " + effect.name + ", reported " + names_of(reported)};
    }
    left.erase(hit);
  }
  if (truth.effects.size() == 1 &&
      family_of(reported.effects.front()).count(truth.effects.front().name) == 0) {
    return {false, what + "; named after " + reported.effects.front().name};
  }
  if (!left.empty()) return {false, what + "; also reported more: " + names_of(reported)};
  return {true, what + "; reported " + names_of(reported)};
}

// Strengths all neutral: places and directions mean nothing.
bool does_nothing(const Effect& entry, const TrueEffect& effect) {
  for (std::size_t i = 0; i < entry.strengths; ++i) {
    const auto found = effect.parameters.find(entry.parameters[i].key);
    if (found != effect.parameters.end() && found->second != entry.parameters[i].nominal) {
      return false;
    }
  }
  return true;
}

// `turn`: after which the value means the same; 0: never.
bool holds(double lo, double hi, double value, double turn) {
  if (turn == 0) return value >= lo && value <= hi;
  // The turn of `value` that is the first at or above lo.
  return value + turn * std::ceil((lo - value) / turn) <= hi;
}

// Effects without an arrow: half a turn changes nothing, and a quarter of one undoes them.
bool has_no_arrow(const std::string& effect) {
  const std::optional<Polar>& polar = effect_diagnosis(effect).polar;
  return polar && polar->symmetry == 2;
}

// The same effect with its strength above neutral, as a diagnosis shows it.
std::map<std::string, double> as_reported(const TrueEffect& effect) {
  std::map<std::string, double> stated = effect.parameters;
  if (!has_no_arrow(effect.name) || !stated.count("direction")) return stated;
  const auto ratio = stated.find("ratio"), stretch = stated.find("stretch");
  const bool across = (ratio != stated.end() && ratio->second < 1) ||
                      (stretch != stated.end() && stretch->second < 0);
  if (!across) return stated;
  if (ratio != stated.end()) ratio->second = 1 / ratio->second;
  if (stretch != stated.end()) stretch->second = -stretch->second;
  stated["direction"] += std::numbers::pi / 2;
  return stated;
}

}  // namespace

Result<Reported> parse_reported(const std::string& text, const std::string& file) {
  const Json json = parse_json(text);
  if (!json.is_object()) return Error{file + ": is not a JSON object, expected a diagnosis"};
  static constexpr const char* kVerdicts[] = {"effect", "none", "unknown", "effect+unknown"};
  const Json verdict = json.value("verdict", Json());
  if (std::find(std::begin(kVerdicts), std::end(kVerdicts), verdict) == std::end(kVerdicts)) {
    return Error{file + ": \"verdict\" is " + json_text(verdict) +
                 ", expected \"effect\", \"none\", \"unknown\" or \"effect+unknown\""};
  }
  Reported reported;
  reported.verdict = verdict.get<std::string>();
  const Json effects = json.value("effects", Json::array());
  for (const Json& effect : effects) {
    if (!effect.is_object() || !effect.value("name", Json()).is_string()) {
      return Error{file + ": \"effects\" holds " + json_text(effect) +
                   ", expected objects with a name"};
    }
    reported.effects.push_back(reported_effect(effect));
  }
  for (const Json& row : json.value("screening", Json::array())) {
    if (!row.is_object() || !row.value("detectable_from", Json()).is_object()) continue;
    const std::string effect = row.value("effect", std::string());
    for (const auto& [key, size] : row["detectable_from"].items()) {
      if (size.is_number()) reported.detectable_from[effect + "." + key] = size.get<double>();
    }
  }
  return reported;
}

std::optional<bool> missed_below(const Truth& truth, const Reported& reported) {
  std::optional<bool> below;
  for (const TrueEffect& effect : truth.effects) {
    const bool named = std::ranges::any_of(reported.effects, [&](const ReportedEffect& one) {
      return family_of(one).count(effect.name) > 0;
    });
    const Effect* entry = catalogue_entry(effect.name);
    if (named || !entry || truth.kind == CaseKind::kOutside) continue;
    for (std::size_t i = 0; i < entry->strengths; ++i) {
      const Parameter& p = entry->parameters[i];
      const auto value = effect.parameters.find(p.key);
      const auto from = reported.detectable_from.find(effect.name + "." + p.key);
      if (value == effect.parameters.end() || from == reported.detectable_from.end()) continue;
      below = below.value_or(true) && std::abs(value->second - p.nominal) < from->second;
    }
  }
  return below;
}

Judgement judge(const Truth& truth, const Reported& reported) {
  for (const ReportedEffect& effect : reported.effects) {
    if (effect.aliases.size() > kMaxAliases) {
      return {false, "more than " + std::to_string(kMaxAliases) + " aliases say nothing"};
    }
  }
  switch (truth.kind) {
    case CaseKind::kNull:
      return {reported.verdict == "none" && reported.effects.empty(),
              "null; reported " + names_of(reported)};
    case CaseKind::kOutside:
      return {(reported.verdict == "unknown" || reported.verdict == "effect+unknown") &&
                  reported.effects.empty(),
              "outside the catalogue; reported " + names_of(reported)};
    case CaseKind::kSingle:
    case CaseKind::kPair:
      break;
  }
  return judge_effects(truth, reported);
}

std::string first_reported(const Reported& reported) {
  return reported.effects.empty() ? reported.verdict : reported.effects.front().name;
}

std::vector<Coverage> coverage_of(const Truth& truth, const Reported& reported) {
  std::vector<Coverage> all;
  for (const TrueEffect& effect : truth.effects) {
    const auto named = std::ranges::find(reported.effects, effect.name, &ReportedEffect::name);
    const Effect* entry = catalogue_entry(effect.name);
    if (named == reported.effects.end() || !entry) continue;
    const bool neutral = does_nothing(*entry, effect);
    const std::map<std::string, double> stated = as_reported(effect);
    for (std::size_t i = 0; i < entry->parameters.size(); ++i) {
      const Parameter& p = entry->parameters[i];
      const auto value = stated.find(p.key);
      if (value == stated.end() || !p.choices.empty()) continue;
      if (neutral && i >= entry->strengths) continue;
      Coverage coverage{effect.name, p.key, value->second, kAbsent, kAbsent, false};
      coverage.is_strength = i < entry->strengths;
      for (const ReportedParameter& s : named->parameters) {
        if (s.key != p.key) continue;
        coverage.lo = s.lo;
        coverage.hi = s.hi;
        // A direction's bounds are a whole turn of it apart.
        const double turn = p.key == "direction" ? p.upper - p.lower : 0;
        coverage.covered = holds(s.lo, s.hi, value->second, turn);
        if (!(s.sd > 0)) continue;
        const double half = kNormal90 * s.sd;
        coverage.covered_by_fit = holds(s.value - half, s.value + half, value->second, turn);
        if (s.bound > 0) coverage.fit_over_bound = s.sd / s.bound;
      }
      all.push_back(coverage);
    }
  }
  return all;
}

double promised_shrinkage(const Reported& reported) {
  double sum = 0;
  for (const ReportedEffect& effect : reported.effects) sum += effect.closed;
  return sum;
}

Interval wilson_interval(const Rate& rate) {
  if (rate.total == 0) return {0, 1};
  constexpr double z = 1.959964;  // of the normal law's middle 95 %
  const double n = rate.total;
  const double p = rate.share();
  const double z2 = z * z;
  const double centre = (p + z2 / (2 * n)) / (1 + z2 / n);
  const double half = z / (1 + z2 / n) * std::sqrt(p * (1 - p) / n + z2 / (4 * n * n));
  return {rate.hits == 0 ? 0 : std::max(0.0, centre - half),
          rate.hits == rate.total ? 1 : std::min(1.0, centre + half)};
}

}  // namespace gapfarm
