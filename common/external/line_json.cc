#include "common/external/line_json.h"

#include <nlohmann/json.hpp>
#include <regex>

namespace gapfarm::line_json {

constexpr std::size_t kShown = 80;

static bool is_control(char c) { return static_cast<unsigned char>(c) < ' ' || c == 127; }

std::string shown(const std::string& text) {
  // What json_text() makes of bytes that are not UTF-8 can be read again.
  auto beginning = parse_json(json_text(Json(text.substr(0, kShown)))).get<std::string>();
  std::ranges::replace_if(beginning, is_control, '?');
  return "'" + beginning + (text.size() > kShown ? "...'" : "'");
}

Error wrong(const std::string& what, const std::string& line) {
  return Error{what + ": " + shown(line)};
}

Result<Json> read_object(const std::string& line, const std::string& what,
                         std::string* not_a_number) {
  Json json = parse_json(line);
  if (json.is_object()) return json;
  static const std::regex kNotNumbers("-?\\b(NaN|Infinity|nan|inf)\\b");
  std::smatch found;
  if (!std::regex_search(line, found, kNotNumbers)) return wrong(what, line);
  json = parse_json(std::regex_replace(line, kNotNumbers, "null"));
  if (!json.is_object()) return wrong(what, line);
  if (not_a_number == nullptr) {
    return wrong("printed " + found.str() +
                     ", which is no number in JSON: print null for a pose "
                     "that a simulation does not have",
                 line);
  }
  *not_a_number = found.str();
  return json;
}

std::string word_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  std::string word = found != json.end() && found->is_string() ? found->get<std::string>() : "";
  // It goes into one line of models and messages.
  std::ranges::replace_if(word, is_control, ' ');
  return word;
}

}  // namespace gapfarm::line_json
