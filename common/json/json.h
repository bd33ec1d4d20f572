// JSON from text and to text, compiled once: whoever only builds or reads values is spared
// nlohmann's parser and writer.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace gapfarm {

using Json = nlohmann::ordered_json;  // keys in the order in which they were put in

// The value that `text` holds; a discarded one (is_discarded()) when it is not JSON.
Json parse_json(std::string_view text);

// In one line, or with `indent` spaces a level.  Bytes that are not UTF-8 become U+FFFD.
std::string json_text(const Json& json, int indent = -1);
std::string json_text(const nlohmann::json& json, int indent = -1);

}  // namespace gapfarm
