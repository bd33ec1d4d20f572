#include "common/json/json.h"

#include <nlohmann/json.hpp>

namespace gapfarm {
namespace {

template <class Json>
std::string text_of(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

Json parse_json(std::string_view text) { return Json::parse(text, nullptr, false); }

std::string json_text(const Json& json, int indent) { return text_of(json, indent); }

std::string json_text(const nlohmann::json& json, int indent) { return text_of(json, indent); }

}  // namespace gapfarm
