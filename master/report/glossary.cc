#include <spdlog/fmt/fmt.h>

#include <cassert>
#include <sstream>
#include <string>

#include "common/base/ranges.h"
#include "master/report/html.h"
#include "master/report/page_texts.h"

namespace gapfarm {
namespace {

struct Entry {
  std::string id, name, text;
};

// Of glossary.txt: a line "id: name", and below it the text with two blanks before each line.
std::vector<Entry> read_entries() {
  std::vector<Entry> all;
  std::istringstream lines(kGlossary);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  ")) {
      all.back().text += line.substr(all.back().text.empty() ? 2 : 1);
    } else {
      const std::size_t colon = line.find(": ");
      all.push_back({line.substr(0, colon), line.substr(colon + 2), ""});
    }
  }
  return all;
}

const Entry* find(std::string_view id) {
  static const std::vector<Entry> all = read_entries();
  return find_by(all, id, &Entry::id);
}

}  // namespace

std::string term(std::string_view id, std::string_view shown) {
  assert(find(id) != nullptr);
  return fmt::format(R"(<a class="term" href="#term-{}">{}</a>)", id, html_escaped(shown));
}

std::string glossary_section(const std::vector<std::string_view>& ids) {
  std::string html = R"(<section id="words"><h2>Words</h2><dl class="glossary">)";
  for (const std::string_view id : ids) {
    const Entry* entry = find(id);
    assert(entry != nullptr);
    html += fmt::format(R"(<div id="term-{}"><dt>{}</dt><dd>{}</dd></div>)", id,
                        html_escaped(entry->name), html_escaped(entry->text));
  }
  return html + "</dl></section>\n";
}

const std::vector<std::string_view>& diagnosis_terms() {
  static const std::vector<std::string_view> ids = {
      "nat",   "gap",         "floor", "tuned",    "final",      "held-out", "interval",
      "bound", "correlation", "rms",   "residual", "ellipse",    "trend",    "share",
      "p",     "telling",     "gain",  "closed",   "confidence", "alias"};
  return ids;
}

const std::vector<std::string_view>& run_terms() {
  static const std::vector<std::string_view> ids = {
      "nat",   "before",     "after",    "generation", "population", "operator",
      "bound", "validation", "baseline", "rms",        "residual",   "ellipse"};
  return ids;
}

}  // namespace gapfarm
