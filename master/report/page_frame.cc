#include "master/report/page_frame.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "master/report/html.h"
#include "master/report/page_texts.h"

namespace gapfarm {
namespace {

// The picture within the page needs no XML declaration.
std::string_view without_declaration(std::string_view svg) {
  const std::size_t begun = svg.find("<svg");
  return begun == std::string_view::npos ? svg : svg.substr(begun);
}

std::string security_policy(bool served) {
  const auto hashes = [](std::span<const std::string_view> contents) {
    std::string list;
    for (const std::string_view content : contents) list += " '" + csp_hash(content) + "'";
    return list;
  };
  static const std::string known =
      "; script-src" + hashes(page_scripts()) + "; style-src" + hashes(page_styles());
  const std::string own = served ? "connect-src 'self'; form-action 'self'" : "form-action 'none'";
  return "default-src 'none'; base-uri 'none'; " + own + "; img-src data:" + known;
}

std::string head(const PageFrame& frame) {
  std::string html = fmt::format(
      R"(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="gapfarm">
<link rel="icon" href="data:,">
<title>{}</title>
)",
      security_policy(frame.served), html_escaped(frame.title));
  for (const std::string_view style : page_styles()) {
    html += fmt::format("<style>{}</style>\n", style);
  }
  return html + "</head>\n";
}

std::string top(const PageFrame& frame) {
  std::string links;
  for (const auto& [id, label] : frame.places) {
    links += fmt::format(R"(<a href="#{}">{}</a>)", id, label);
  }
  return fmt::format(
      R"(<a class="skip" href="#{}">Skip to the first section</a>
<header class="top"><span class="brand">{} <span>{}</span></span>
<nav aria-label="Sections">{}</nav>
<button type="button" id="theme" hidden>Dark</button></header>
)",
      frame.places.front().first,
      frame.served ? R"(<a href="/" title="All runs and diagnoses">gapfarm</a>)" : "gapfarm",
      html_escaped(frame.brand), links);
}

// A key to the marks of the plots, by what the page calls the models.
std::string plot_key(const ModelNames& models, bool measured) {
  std::string items;
  if (measured) {
    items =
        R"(<li><svg class="mark" aria-hidden="true"><path class="measured" d="M7 7l6 6M13 7l-6 6"/></svg>measured</li>)";
  }
  return fmt::format(
      R"(<ul class="key" aria-label="Key">{}<li><svg class="mark" aria-hidden="true"><path class="tuned" d="M1 10h18"/><path class="tuned solid" d="M10 5.5l4.5 4.5-4.5 4.5-4.5-4.5z"/></svg>{}</li>
<li><svg class="mark" aria-hidden="true"><path class="final" d="M1 10h18"/><circle class="final" cx="10" cy="10" r="3.5"/></svg>{}</li></ul>)",
      items, models.tuned, models.final_);
}

std::string data_block(const char* id, const Json& json) {
  return fmt::format("<script type=\"application/json\" id=\"{}\">{}</script>\n", id,
                     script_safe(json_text(json)));
}

}  // namespace

void PageFrame::add(const char* id, const char* place, const std::string& section) {
  if (section.empty()) return;
  places.emplace_back(id, place);
  body += section;
}

void PlainPage::heading(std::string_view content) {
  body_ += fmt::format("<h2>{}</h2>\n", html_escaped(content));
}

void PlainPage::paragraph(std::string_view content) {
  body_ += fmt::format("<p>{}</p>\n", html_escaped(content));
}

void PlainPage::table(const TextTable& table) {
  body_ += "<div class=\"scroll\"><table>\n<thead><tr>";
  for (const std::string& cell : table.head) {
    body_ += fmt::format("<th scope=\"col\">{}</th>", html_escaped(cell));
  }
  body_ += "</tr></thead>\n<tbody>\n";
  for (const TextTable::Row& row : table.rows) {
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
      csp_hash(kPlainStyle), title, kPlainStyle, title, body_);
}

const char* const kNoScript =
    R"(<noscript><p class="quiet">The plots need scripts; the tables do not.</p></noscript>)";

std::string plot_area(std::string_view name) {
  return fmt::format(
      R"(<div class="controls" id="{0}-controls"></div><div id="{0}-plot"></div>{1})", name,
      kNoScript);
}

std::string plot_grid(std::string_view name) {
  return fmt::format(
      R"(<div class="controls" id="{0}-controls"></div><div class="grid" id="{0}-plots"></div>{1})",
      name, kNoScript);
}

std::string floor_section() {
  std::string html = R"(<section id="floor"><h2>Where on the floor</h2>
<p>Every drive from where it began to where it ended, coloured by how far off its prediction was. Black arrows point from the measured end along the error, drawn longer than it is. What a named effect has to do with a place or a direction is drawn in. Drag to zoom, click a drive to see it below.</p>
<div class="controls" id="floor-controls"></div><ul class="key" id="floor-legend" aria-label="Colours"></ul>
<div id="floor-plot"></div>)";
  html += kNoScript;
  return html + "</section>\n";
}

std::string drives_section(const ModelNames& models) {
  return R"(<section id="drives"><h2>One real drive over the simulated ones</h2>
<p>The worst and the median drive, by the first model's log score.</p>)" +
         plot_key(models, true) + plot_grid("drive") + "</section>\n";
}

std::string poses_section(std::string_view heading, std::string_view text,
                          const ModelNames& models) {
  return fmt::format("<section id=\"poses\"><h2>{}</h2>\n<p>{}</p>{}{}</section>\n", heading, text,
                     plot_key(models, true), plot_grid("pose"));
}

std::string residual_plots(std::string_view heading, std::string_view text,
                           const ModelNames& models) {
  return fmt::format(
      "<h3 id=\"residual-title\">{}</h3>\n<p>{} Lines join the means of neighbouring trials, with "
      "90 % intervals.</p>{}{}</section>\n",
      heading, text, plot_key(models, false), plot_grid("residual"));
}

std::string watch_section(std::string_view what) {
  const char* any = what == "window" ? "Any window of the logged runs, from its measured start on"
                    : what == "push" ? "Any push of the log"
                                     : "Any trial of the log";
  return fmt::format(
             R"(<section id="watch"><h2>Watch a {}</h2>
<p>{}, seen from above: as it was measured, and as the config's values and the best of a generation have it without chance. The server simulates what is asked for.</p>)",
             what, any) +
         plot_key({"before", "best"}, true) +
         R"(<div class="controls" id="watch-controls"></div><p class="quiet" id="watch-said" role="status"></p><div id="watch-plot"></div>)" +
         kNoScript + "</section>\n";
}

Json no_plots() { return {{"models", Json::object()}, {"without_trials", ""}}; }

Json no_trials() { return {{"columns", Json::array()}, {"rows", Json::array()}}; }

std::string framed_page(PageFrame frame, Json page, const Json& trials) {
  frame.add("words", "Words", glossary_of(frame.body));
  page["served"] = frame.served;
  std::string html =
      head(frame) + "<body>\n" + kHatches + top(frame) + "<main>\n" + frame.body +
      (frame.served
           ? R"(<p id="live" class="live" role="status"></p><noscript><p class="quiet">Reload the page to look again.</p></noscript></main>)"
           : "</main>") +
      "\n<footer>Made by gapfarm. " +
      (frame.served ? "What stands here is read from stores; nothing here can change them. "
                    : "This page needs no network. ") +
      R"(<button type="button" id="all-trials" hidden>All trials as CSV</button></footer>)"
      "\n";
  html += data_block("page", page);
  html += data_block("trials", trials);
  for (const std::string_view script : page_scripts()) {
    html += fmt::format("<script>{}</script>\n", script);
  }
  return html + "</body>\n</html>\n";
}

std::string framed_page(PageFrame frame) {
  return framed_page(std::move(frame), no_plots(), no_trials());
}

}  // namespace gapfarm
