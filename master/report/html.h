// Words and numbers for a page: everything that is not markup goes through here.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gapfarm {

// Safe as text and within quoted attributes.  Control characters other than tab and newline, which
// HTML does not allow, become U+FFFD.
std::string html_escaped(std::string_view text);

// JSON that can stand inside a <script> element: nothing in it can end the element or open a
// comment.  Still the same JSON.
std::string script_safe(std::string_view json);

// Of numbers in a page's data: plots do not need more, and the page stays small.
inline constexpr int kPlotDigits = 7;

// "0.412", "1,230", "−3.2": about three significant digits; "–" when not finite.
std::string number_text(double value, int digits = 3);

// "0.28 m/s"; the text alone where there is no unit ("" or "-").
std::string with_unit(std::string text, std::string_view unit, std::string_view between = " ");

// "88 %"; "–" when not finite.
std::string percent_text(double share);

// "0.03", "< 0.0001".
std::string p_text(double p);

// A column of a page's table.  Where rows become cards, on a narrow screen, each cell shows the
// column's label: its head, unless that has markup.
struct HtmlColumn {
  std::string head;
  std::string css = {};  // of its cells; the head of "number ..." is aligned alike
  std::string label = {};
  bool sorted_by = false;  // the rows are, descending
};

struct HtmlRow {
  std::string head;  // of the row: its first cell
  std::vector<std::string> cells;
  std::string css = {};
};

// `css`: "cards" becomes cards on a narrow screen, "parts" and "plain" do not.  `file`: what a copy
// of the table is called, empty: none is offered; `caption` is for screen readers.  Heads and cells
// are HTML.
std::string html_table(std::string_view css, std::string_view file, std::string_view caption,
                       const std::vector<HtmlColumn>& columns, const std::vector<HtmlRow>& rows);

// Names, as code; a list of sentences.  Both of text.
std::string html_names(const std::vector<std::string>& names, std::string_view between = ", ");
std::string html_list(const std::vector<std::string>& lines, std::string_view css = "");

// `heading` and `content` are HTML.
std::string html_section(std::string_view id, std::string_view heading, std::string_view content);

// A list of labels with their values, both text.
std::string html_definitions(const std::vector<std::pair<std::string, std::string>>& rows);

// "sha256-<base64>", as a content security policy names an inline script or style.
std::string csp_hash(std::string_view content);

// A bar of `share` of the width, [0, 1], hidden from screen readers: the number stands beside it.
std::string bar_svg(double share, std::string_view css_class);

// One of the few figures that matter, before the change and after; HTML.  `before`: empty without.
std::string html_tile(std::string_view title, const std::string& before, std::string_view after,
                      std::string_view unit, std::string_view small = "");

// An interval on the scale from 0 to 1, with its estimate.
std::string interval_svg(double value, double lo, double hi);

// The words of a page that need an explanation.

// `words` as a link to what the glossary says of `id`; pages show that beside it on hover or focus.
// REQUIRES: the glossary has `id`.
std::string term(std::string_view id, std::string_view shown);

// The section that explains the words of this HTML; it prints, too.
std::string glossary_of(std::string_view page);

}  // namespace gapfarm
