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

const std::vector<Entry>& entries() {
  static const std::vector<Entry> all = read_entries();
  return all;
}

std::string link_to(std::string_view id) { return fmt::format(R"(href="#term-{}")", id); }

}  // namespace

std::string term(std::string_view id, std::string_view shown) {
  assert(contains(entries(), id, &Entry::id));
  return fmt::format(R"(<a class="term" {}>{}</a>)", link_to(id), html_escaped(shown));
}

std::string glossary_of(std::string_view page) {
  std::string html;
  for (const Entry& entry : entries()) {
    if (page.find(link_to(entry.id)) == page.npos) continue;
    html += fmt::format(R"(<div id="term-{}"><dt>{}</dt><dd>{}</dd></div>)", entry.id,
                        html_escaped(entry.name), html_escaped(entry.text));
  }
  if (html.empty()) return html;
  return R"(<section id="words" data-live><h2>Words</h2><dl class="glossary">)" + html +
         "</dl></section>\n";
}

}  // namespace gapfarm
