#include "master/experiments/blind_check/cases/seal.h"

#include <sodium.h>
#include <sys/prctl.h>

#include <algorithm>
#include <cassert>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/base/ranges.h"
#include "common/json/fields.h"
#include "common/json/json.h"

namespace gapfarm {

namespace {

// A number, or the word of a choice as its index.  None for anything else: an effect outside the
// catalogue may have parameters of any form, and nothing compares them.
std::optional<double> parameter_value(const std::string& effect, const std::string& key,
                                      const Json& value) {
  if (value.is_number()) return value.get<double>();
  if (!value.is_string()) return std::nullopt;
  const Effect* entry = catalogue_entry(effect);
  if (entry == nullptr) return std::nullopt;
  for (const Parameter& p : entry->parameters) {
    const auto word = std::ranges::find(p.choices, value.get<std::string>());
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

constexpr std::size_t kSaltBytes = 16;
constexpr std::size_t kSealBytes = 32;

void start_sodium() {
  const int ready = sodium_init();
  assert(ready >= 0);
  (void)ready;
}

std::string hex(const unsigned char* bytes, std::size_t size) {
  std::string text(2 * size + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), bytes, size);
  text.pop_back();
  return text;
}

const unsigned char* raw(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

constexpr auto kSealed = [](auto& v, auto& row) { FIELDS(id, salt, truth); };

}  // namespace

const Effect* catalogue_entry(const std::string& name) {
  for (const std::span<const Effect> catalogue : {srv1_effects_and_seconds(), push_effects()}) {
    if (const Effect* effect = find_by(catalogue, name, &Effect::name)) return effect;
  }
  return nullptr;
}

const char* case_kind_name(CaseKind kind) {
  constexpr const char* kNames[] = {"null", "single", "pair", "outside"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string answer_of(const Truth& truth) {
  return truth.kind == CaseKind::kNull      ? "none"
         : truth.kind == CaseKind::kOutside ? "unknown"
                                            : "effect";
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
  truth.id = id;
  FieldReader fields(json);
  fields.field("case", truth.id);
  fields.field("level", truth.level);
  fields.field("left_out", truth.excluded);
  const Json sizes = json.value("size", Json::object());
  for (const auto& [name, parameters] : effects.items()) {
    TrueEffect effect{name, {}, 1};
    if (!parameters.is_object()) return wrong(file, "effect \"" + name + "\" is no object");
    for (const auto& [key, value] : parameters.items()) {
      if (const auto number = parameter_value(name, key, value)) effect.parameters[key] = *number;
    }
    FieldReader(sizes).field(name, effect.size);
    truth.effects.push_back(std::move(effect));
  }
  fields.field("seed", truth.seed);
  const Json robot = json.value("robot", Json::object());
  if (robot.is_object()) {
    for (const auto& [key, value] : robot.items()) {
      if (value.is_number()) truth.robot[key] = value.get<double>();
    }
  }
  truth.kind = kind_of(answer.get<std::string>(), truth.effects.size());
  return truth;
}

std::string random_salt() {
  start_sodium();
  unsigned char bytes[kSaltBytes];
  randombytes_buf(bytes, sizeof bytes);
  return hex(bytes, sizeof bytes);
}

std::string seal_of(std::string_view salt, std::string_view truth) {
  start_sodium();
  crypto_generichash_state state;
  crypto_generichash_init(&state, nullptr, 0, kSealBytes);
  crypto_generichash_update(&state, raw(salt), salt.size());
  crypto_generichash_update(&state, raw(truth), truth.size());
  unsigned char digest[kSealBytes];
  crypto_generichash_final(&state, digest, sizeof digest);
  return hex(digest, sizeof digest);
}

std::string format_seals(const std::vector<SealedTruth>& truths) {
  return joined(truths, "",
                [](const SealedTruth& t) { return t.id + " " + seal_of(t.salt, t.truth) + "\n"; });
}

Status verify_seals(const std::vector<SealedTruth>& truths, std::string_view seals,
                    const std::string& file) {
  std::map<std::string, std::string> published;
  std::istringstream lines{std::string(seals)};
  for (std::string id, seal; lines >> id >> seal;) {
    if (!published.emplace(id, seal).second) return Error{file + ": two seals of " + id};
  }
  for (const SealedTruth& t : truths) {
    const auto found = published.find(t.id);
    if (found == published.end()) return Error{file + ": no seal of " + t.id};
    if (found->second != seal_of(t.salt, t.truth)) {
      return Error{file + ": the truth of " + t.id +
                   " does not match its seal; one of them was changed after sealing"};
    }
    published.erase(found);
  }
  if (published.empty()) return {};
  return Error{file + ": the truth of " + published.begin()->first + " is missing"};
}

std::string format_sealed(const std::vector<SealedTruth>& truths) {
  return json_text(FieldWriter::list(truths, kSealed), 1) + "\n";
}

Result<std::vector<SealedTruth>> parse_sealed(const std::string& text, const std::string& file) {
  const Json json = parse_json(text);
  if (!json.is_array()) return Error{file + ": holds no truths of a blind check"};
  return mapped(json, [](const Json& t) { return FieldReader::read<SealedTruth>(t, kSealed); });
}

PrivateMemory::PrivateMemory() : before_(::prctl(PR_GET_DUMPABLE)) { ::prctl(PR_SET_DUMPABLE, 0); }

PrivateMemory::~PrivateMemory() {
  if (before_ == 1) ::prctl(PR_SET_DUMPABLE, 1);
}

}  // namespace gapfarm
