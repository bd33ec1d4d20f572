// What the names of columns say.

#include <cctype>
#include <regex>
#include <string_view>
#include <utility>

#include "master/io/logs/column_map.h"

namespace gapfarm {

std::string plain_name(const std::string& name) {
  std::string out;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const char c = name[i];
    if (c == '[' || c == '(') break;
    const bool word = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '%';
    if (word) {
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    } else if (!out.empty() && out.back() != '.') {
      out += '.';
    }
  }
  while (!out.empty() && out.back() == '.') out.pop_back();
  if (out.rfind("field.", 0) == 0) out.erase(0, 6);
  return out;
}

namespace {

bool fits(const std::string& column, const std::string& alias) {
  if (alias.rfind("*.", 0) != 0) return column == alias;
  return column == alias.substr(2) || column.ends_with(alias.substr(1));
}

// "phi_r" of "phi_l", "right.ticks" of "left.ticks", "wr" of "wl"; empty: it has no side.
std::string other_side(const std::string& name) {
  static const std::regex kLeft("left"), kL("(^|[._])l($|[._])"), kEnd("l$");
  if (std::regex_search(name, kLeft)) return std::regex_replace(name, kLeft, "right");
  if (std::regex_search(name, kL)) return std::regex_replace(name, kL, "$1r$2");
  return std::regex_search(name, kEnd) ? std::regex_replace(name, kEnd, "r") : "";
}

}  // namespace

std::string column_of(const LogTable& table, const Aliases& aliases) {
  for (const std::string& alias : aliases) {
    for (const std::string& column : table.columns) {
      if (fits(plain_name(column), alias)) return column;
    }
  }
  return {};
}

bool has_word(const std::string& name, const std::string& word) {
  return std::regex_search(name, std::regex("(^|[^A-Za-z0-9])" + word + "([^A-Za-z0-9]|$)"));
}

std::string unit_in_name(const std::string& name) {
  const std::size_t from = name.find_first_of("[("), end = name.find_first_of("])");
  if (from == name.npos || end == name.npos || end < from) return "";
  const std::string unit = name.substr(from + 1, end - from - 1);
  return !unit.empty() && unit_factor(unit) != 0 ? unit : "";
}

void join_times(LogTable* table) {
  constexpr std::pair<std::string_view, const char*> kParts[] = {
      {"sec", "nanosec"}, {"sec", "nsec"}, {"secs", "nsecs"}};
  const std::vector<std::string> columns = table->columns;
  for (std::size_t s = 0; s < columns.size(); ++s) {
    for (const auto& [whole, rest] : kParts) {
      if (!columns[s].ends_with(whole)) continue;
      std::string name = columns[s].substr(0, columns[s].size() - whole.size());
      const auto ns = table->find(name + rest);
      name.erase(name.find_last_not_of("._/") + 1);
      if (name.empty()) name = "stamp";
      if (!ns || table->find(name)) continue;
      std::vector<double> values;
      for (std::size_t r = 0; r < table->rows(); ++r) {
        for (std::size_t c = 0; c < table->columns.size(); ++c) values.push_back(table->at(r, c));
        values.push_back(table->at(r, s) + 1e-9 * table->at(r, *ns));
      }
      table->values = std::move(values);
      table->columns.push_back(name);
      if (!table->titles.empty()) table->titles.push_back(name);
      if (!table->units.empty()) table->units.push_back({"s", {}});
    }
  }
}

std::vector<std::string> sides_of(const LogTable& table) {
  for (const std::string& left : table.columns) {
    const std::string right = other_side(plain_name(left));
    if (right.empty() || column_of(table, {right}).empty()) continue;
    return {left, column_of(table, {right})};
  }
  return {};
}

}  // namespace gapfarm
