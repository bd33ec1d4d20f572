#include "common/external/line_json.h"

#include <nlohmann/json.hpp>
#include <regex>

#include "common/json/json.h"

namespace gapfarm::line_json {

constexpr std::size_t kShown = 80;

Error wrong(const std::string& what, const std::string& line) {
  std::string shown = line.substr(0, kShown);
  for (char& c : shown) {
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = '?';
  }
  return Error{what + ": '" + shown + (line.size() > kShown ? "...'" : "'")};
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
  for (char& c : word) {  // it goes into one line of models and messages
    if (static_cast<unsigned char>(c) < ' ' || c == 127) c = ' ';
  }
  return word;
}

}  // namespace gapfarm::line_json
