#include "master/experiments/blind_check/reported.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/json/json.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

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
    const ReportedParameter p{key, number_at(value, "value"), number_at(value, "lo"),
                              number_at(value, "hi")};
    if (std::isfinite(p.lo) && std::isfinite(p.hi)) effect.parameters.push_back(p);
  }
  return effect;
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
  return reported;
}

}  // namespace gapfarm
