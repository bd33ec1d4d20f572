// Logs of JSON objects, one a line or all in one array, as the rows of a table: a column is named
// by the path to its value.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <unordered_map>
#include <utility>

#include "common/base/text.h"
#include "common/json/json.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/bags.h"

namespace gapfarm {
namespace {

using Leaves = std::vector<std::pair<std::string, std::string>>;  // paths and texts

// Longer arrays (a scan's ranges) are no columns, and what lies deeper is no log.
constexpr std::size_t kLongestArray = 64;
constexpr int kDeepestObject = 16;

// Three numbers are a planar pose, three times three its covariance.
std::string name_of_element(std::size_t k, std::size_t size) {
  constexpr const char* kPose[] = {"x", "y", "theta"};
  return size == 3 ? kPose[k] : std::to_string(k + 1);
}

bool is_covariance(const Json& value) {
  return value.is_array() && value.size() == 3 && std::ranges::all_of(value, [](const Json& row) {
           return row.is_array() && row.size() == 3;
         });
}

void add_leaves(const std::string& path, const Json& value, int depth, Leaves* leaves) {
  const std::string to = path.empty() ? "" : path + ".";
  if (depth > kDeepestObject || (value.is_array() && value.size() > kLongestArray)) return;
  if (is_covariance(value)) {
    constexpr char kAxes[] = "xyt";
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = i; k < 3; ++k) {
        add_leaves(path + "_" + kAxes[i] + kAxes[k], value[i][k], depth + 1, leaves);
      }
    }
  } else if (value.is_array()) {
    for (std::size_t k = 0; k < value.size(); ++k) {
      add_leaves(to + name_of_element(k, value.size()), value[k], depth + 1, leaves);
    }
  } else if (value.is_object()) {
    for (const auto& [key, part] : value.items()) add_leaves(to + key, part, depth + 1, leaves);
  } else if (value.is_string()) {
    leaves->emplace_back(path, value.get<std::string>());
  } else {
    leaves->emplace_back(path, value.is_null() ? "" : json_text(value));
  }
}

}  // namespace

Result<std::vector<CsvRow>> rows_of_json(std::string_view text, const std::string& file) {
  std::vector<std::pair<Json, std::size_t>> objects;  // and their lines
  if (text.find('[') < text.find('{')) {
    Json all = parse_json(text);
    for (Json& object : all) objects.emplace_back(std::move(object), 1);
  } else {
    std::size_t number = 0;
    for (const std::string_view line : lines_of(text)) {
      ++number;
      if (!tokens_of(line).empty()) objects.emplace_back(parse_json(line), number);
    }
  }
  CsvRow names;
  std::unordered_map<std::string, std::size_t> column;  // of a name
  std::vector<CsvRow> rows;
  for (const auto& [object, line] : objects) {
    const TextPlace place = {line, 1};
    CsvRow row{std::vector<CsvField>(names.fields.size(), CsvField{"", place}), place};
    Leaves leaves;
    if (object.is_object()) add_leaves("", object, 0, &leaves);
    for (auto& [name, value] : leaves) {
      if (rows.empty() && column.try_emplace(name, column.size()).second) {
        names.fields.push_back({name, place});
        row.fields.push_back({});
      }
      if (const auto at = column.find(name); at != column.end()) {
        row.fields[at->second] = {std::move(value), place};
      }
    }
    // Another number of fields than the head's: its reader says so.
    if (leaves.empty()) row.fields.clear();
    rows.push_back(std::move(row));
  }
  if (names.fields.empty()) {
    return text_error(file, {}, "JSON", "objects with numbers, one a line or all in one array",
                      "export the log so, or as CSV");
  }
  rows.insert(rows.begin(), std::move(names));
  return rows;
}

}  // namespace gapfarm
