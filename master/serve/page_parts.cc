#include "master/serve/page_parts.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

namespace gapfarm {

nlohmann::ordered_json plain_page_json() {
  return {{"models", nlohmann::ordered_json::object()}, {"served", true}, {"without_trials", ""}};
}

nlohmann::ordered_json no_trials_json() {
  const auto none = nlohmann::ordered_json::array();
  return {{"columns", none}, {"rows", none}};
}

std::string list_cell(const char* label, const std::string& html, bool is_number) {
  return fmt::format(R"(<td data-label="{}" class="{}{}">{}</td>)", label,
                     is_number ? "number" : "", html.empty() ? " empty" : "", html);
}

}  // namespace gapfarm
