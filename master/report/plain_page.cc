#include "master/report/plain_page.h"

#include <spdlog/fmt/fmt.h>

#include "master/report/html.h"

namespace gapfarm {
namespace {

constexpr std::string_view kStyle = R"(
body { margin: 0 auto; max-width: 60rem; padding: 1.5rem; background: #fbfaf7; color: #1c1f23;
  font: 16px/1.5 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
h1 { font-size: 1.6rem; line-height: 1.25; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 0.92rem; }
th, td { padding: 0.3rem 0.8rem; border-bottom: 1px solid #d9d6cf; text-align: right; }
th:first-child, td:first-child { text-align: left; }
figure { margin: 1rem 0; } figure svg { max-width: 100%; height: auto; border-radius: 8px; }
)";

// The picture within the page needs no XML declaration.
std::string_view without_declaration(std::string_view svg) {
  const std::size_t begun = svg.find("<svg");
  return begun == std::string_view::npos ? svg : svg.substr(begun);
}

}  // namespace

void PlainPage::heading(std::string_view content) {
  body_ += fmt::format("<h2>{}</h2>\n", html_escaped(content));
}

void PlainPage::paragraph(std::string_view content) {
  body_ += fmt::format("<p>{}</p>\n", html_escaped(content));
}

void PlainPage::table(const std::vector<std::string>& header,
                      const std::vector<std::vector<std::string>>& rows) {
  body_ += "<div class=\"scroll\"><table>\n<thead><tr>";
  for (const std::string& cell : header) {
    body_ += fmt::format("<th scope=\"col\">{}</th>", html_escaped(cell));
  }
  body_ += "</tr></thead>\n<tbody>\n";
  for (const std::vector<std::string>& row : rows) {
    body_ += "<tr>";
    for (const std::string& cell : row) body_ += fmt::format("<td>{}</td>", html_escaped(cell));
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table></div>\n";
}

void PlainPage::picture(std::string_view svg, std::string_view content) {
  body_ += fmt::format("<figure role=\"img\" aria-label=\"{}\">{}</figure>\n",
                       html_escaped(content), without_declaration(svg));
}

std::string PlainPage::finish() const {
  const std::string title = html_escaped(title_);
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
      "'{}'\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"generator\" content=\"gapfarm\">\n<title>{}</title>\n<style>{}</style>\n"
      "</head>\n<body>\n<h1>{}</h1>\n{}</body>\n</html>\n",
      csp_hash(kStyle), title, kStyle, title, body_);
}

}  // namespace gapfarm
