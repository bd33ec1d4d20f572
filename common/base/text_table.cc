#include "common/base/text_table.h"

#include <algorithm>

#include "common/base/text.h"

namespace gapfarm {
namespace {

// Characters of UTF-8.
std::size_t width_of(const std::string& cell) {
  return static_cast<std::size_t>(
      std::ranges::count_if(cell, [](char c) { return (c & 0xC0) != 0x80; }));
}

std::string markdown_row(const TextTable::Row& cells) {
  return "| " + joined(cells, " | ") + " |\n";
}

}  // namespace

std::string TextTable::text(std::string_view sides, std::string_view indent) const {
  if (rows.empty()) return "";
  std::vector<Row> lines = {head};
  lines.insert(lines.end(), rows.begin(), rows.end());
  std::vector<std::size_t> widths(head.size());
  for (const Row& line : lines) {
    for (std::size_t c = 0; c < line.size(); ++c)
      widths[c] = std::max(widths[c], width_of(line[c]));
  }
  std::string text;
  for (const Row& line : lines) {
    std::string row(indent);
    for (std::size_t c = 0; c < line.size(); ++c) {
      const std::string blanks(widths[c] - width_of(line[c]), ' ');
      const bool right = sides[std::min(c, sides.size() - 1)] == '>';
      row += (c > 0 ? "  " : "") + (right ? blanks + line[c] : line[c] + blanks);
    }
    text += row.substr(0, row.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

std::string TextTable::markdown() const {
  return markdown_row(head) + markdown_row(Row(head.size(), "---")) +
         joined(rows, "", markdown_row);
}

}  // namespace gapfarm
