// Cells of text in rows and columns, for terminals and for Markdown.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gapfarm {

struct TextTable {
  using Row = std::vector<std::string>;

  Row head;
  std::vector<Row> rows = {};  // none longer than the head

  // Lines of columns that are two blanks apart, each after `indent`; nothing without rows.  `sides`
  // holds '<' or '>' a column, its last one counts for all that follow.
  std::string text(std::string_view sides = "<", std::string_view indent = "") const;
  std::string markdown() const;
};

}  // namespace gapfarm
