#include "master/experiments/blind_check/cases/truth.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/json/json.h"

namespace gapfarm {
namespace {

const std::vector<std::string>& kind_names() {
  static const std::vector<std::string> names = {"null", "single", "pair", "outside"};
  return names;
}

// A number, or the word of a choice as its index.  None for anything else: an effect outside the
// catalogue may have parameters of any form, and nothing compares them.
std::optional<double> parameter_value(const std::string& effect, const std::string& key,
                                      const Json& value) {
  if (value.is_number()) return value.get<double>();
  if (!value.is_string()) return std::nullopt;
  const Effect* entry = catalogue_entry(effect);
  if (entry == nullptr) return std::nullopt;
  for (const EffectParameter& p : entry->parameters) {
    const auto word = std::find(p.choices.begin(), p.choices.end(), value.get<std::string>());
    if (p.key == key && word != p.choices.end()) {
      return static_cast<double>(word - p.choices.begin());
    }
  }
  return std::nullopt;
}

CaseKind kind_of(const std::string& answer, std::size_t effects) {
  if (answer == "none") return CaseKind::kNull;
  if (answer == "unknown") return CaseKind::kOutside;
  return effects == 1 ? CaseKind::kSingle : CaseKind::kPair;
}

Error wrong(const std::string& file, const std::string& what) {
  return {file + ": " + what +
          "; a truth holds \"effects\", an object of objects, and \"answer\": "
          "\"none\", \"effect\" or \"unknown\""};
}

}  // namespace

const Effect* catalogue_entry(const std::string& name) {
  for (const std::span<const Effect> catalogue : {srv1_effects_and_seconds(), push_effects()}) {
    for (const Effect& effect : catalogue) {
      if (effect.name == name) return &effect;
    }
  }
  return nullptr;
}

const char* case_kind_name(CaseKind kind) {
  return kind_names()[static_cast<std::size_t>(kind)].c_str();
}

std::string answer_of(const Truth& truth) {
  switch (truth.kind) {
    case CaseKind::kNull:
      return "none";
    case CaseKind::kOutside:
      return "unknown";
    case CaseKind::kSingle:
    case CaseKind::kPair:
      break;
  }
  return "effect";
}

std::string format_truth(const Truth& truth) {
  Json effects = Json::object();
  Json sizes = Json::object();
  for (const TrueEffect& effect : truth.effects) {
    effects[effect.name] = effect.parameters;
    sizes[effect.name] = effect.size;
  }
  const Json json = {{"case", truth.id},          {"kind", case_kind_name(truth.kind)},
                     {"effects", effects},        {"size", sizes},
                     {"level", truth.level},      {"left_out", truth.excluded},
                     {"robot", truth.robot},      {"seed", truth.seed},
                     {"answer", answer_of(truth)}};
  return json_text(json, 1) + "\n";
}

Result<Truth> parse_truth(const std::string& text, const std::string& file, const std::string& id) {
  const Json json = parse_json(text);
  if (!json.is_object()) return wrong(file, "is not a JSON object");
  const Json answer = json.value("answer", Json());
  const Json effects = json.value("effects", Json());
  if (answer != "none" && answer != "effect" && answer != "unknown") {
    return wrong(file, "\"answer\" is " + json_text(answer));
  }
  if (!effects.is_object()) return wrong(file, "\"effects\" is " + json_text(effects));
  if (answer == "effect" && effects.empty()) return wrong(file, "\"effects\" is empty");
  Truth truth;
  truth.id = json.value("case", Json()).is_string() ? json["case"].get<std::string>() : id;
  const Json sizes = json.value("size", Json::object());
  for (const auto& [name, parameters] : effects.items()) {
    TrueEffect effect{name, {}, 1};
    if (!parameters.is_object()) return wrong(file, "effect \"" + name + "\" is no object");
    for (const auto& [key, value] : parameters.items()) {
      if (const auto number = parameter_value(name, key, value)) effect.parameters[key] = *number;
    }
    if (sizes.is_object() && sizes.contains(name) && sizes[name].is_number()) {
      effect.size = sizes[name].get<double>();
    }
    truth.effects.push_back(std::move(effect));
  }
  const Json level = json.value("level", Json());
  if (level.is_string()) truth.level = level.get<std::string>();
  const Json excluded = json.value("left_out", Json());
  if (excluded.is_string()) truth.excluded = excluded.get<std::string>();
  const Json seed = json.value("seed", Json());
  if (seed.is_number_unsigned()) truth.seed = seed.get<std::uint64_t>();
  const Json robot = json.value("robot", Json::object());
  if (robot.is_object()) {
    for (const auto& [key, value] : robot.items()) {
      if (value.is_number()) truth.robot[key] = value.get<double>();
    }
  }
  truth.kind = kind_of(answer.get<std::string>(), truth.effects.size());
  return truth;
}

}  // namespace gapfarm
