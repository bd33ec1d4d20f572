// What the server's own pages are put together from.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace gapfarm {

// The data of a page that has no plots, and of one without trials.
nlohmann::ordered_json plain_page_json();
nlohmann::ordered_json no_trials_json();

// Where rows become cards, on a narrow screen, cells without content are omitted.
std::string list_cell(const char* label, const std::string& html, bool is_number = false);

}  // namespace gapfarm
