#include "master/report/report_html.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>
#include <string_view>

#include "master/diagnose/diagnosis_json.h"
#include "master/report/assets.h"
#include "master/report/gap_split.h"
#include "master/report/html.h"
#include "master/report/report_sections.h"

namespace gapfarm {
namespace {

// Plots do not need more, and the page stays small.  diagnosis.json has every bit.
constexpr int kPlotDigits = 7;

std::string security_policy() {
  const auto hashes = [](std::span<const std::string_view> contents) {
    std::string list;
    for (const std::string_view content : contents) list += " '" + csp_hash(content) + "'";
    return list;
  };
  return "default-src 'none'; base-uri 'none'; form-action 'none'; img-src data:; script-src" +
         hashes(page_scripts()) + "; style-src" + hashes(page_styles());
}

std::string head(const Diagnosis& diagnosis) {
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
      security_policy(),
      html_escaped(diagnosis.headline.empty() ? "gapfarm diagnosis" : diagnosis.headline));
  for (const std::string_view style : page_styles()) {
    html += fmt::format("<style>{}</style>\n", style);
  }
  return html + "</head>\n";
}

// Patterns tell the parts of the gap apart without colour.
constexpr const char* kHatches =
    R"html(<svg class="hatches" width="0" height="0" aria-hidden="true"><defs>
<pattern id="hatch-1" width="8" height="8" patternUnits="userSpaceOnUse"><rect class="ground-1" width="8" height="8"/></pattern>
<pattern id="hatch-2" width="8" height="8" patternUnits="userSpaceOnUse" patternTransform="rotate(45)"><rect class="ground-2" width="8" height="8"/><rect class="ink" width="2.5" height="8"/></pattern>
<pattern id="hatch-3" width="7" height="7" patternUnits="userSpaceOnUse"><rect class="ground-3" width="7" height="7"/><circle class="ink" cx="3.5" cy="3.5" r="1.6"/></pattern>
<pattern id="hatch-4" width="8" height="8" patternUnits="userSpaceOnUse"><rect class="ground-4" width="8" height="8"/><rect class="ink" width="8" height="2.2"/></pattern>
<pattern id="hatch-5" width="8" height="8" patternUnits="userSpaceOnUse"><rect class="ground-5" width="8" height="8"/><path class="ink-line" d="M0 0 8 8M8 0 0 8"/></pattern>
<pattern id="hatch-unexplained" width="9" height="9" patternUnits="userSpaceOnUse" patternTransform="rotate(-45)"><rect class="ground-unexplained" width="9" height="9"/><rect class="ink" width="4.5" height="9"/></pattern>
<pattern id="hatch-floor" width="6" height="6" patternUnits="userSpaceOnUse"><rect class="ground-floor" width="6" height="6"/></pattern>
</defs></svg>
)html";

constexpr const char* kTop = R"(<a class="skip" href="#gap">Skip to the gap</a>
<header class="top"><span class="brand">gapfarm <span>diagnosis</span></span>
<nav aria-label="Sections"><a href="#gap">Gap</a><a href="#poses">Poses</a><a href="#residuals">Residuals</a><a href="#screening">Catalogue</a><a href="#shrinkage">Shrinkage</a><a href="#next">Next</a><a href="#provenance">Inputs</a></nav>
<button type="button" id="theme" hidden>Dark</button></header>
)";

constexpr const char* kMeasuredKey =
    R"(<li><svg class="mark" aria-hidden="true"><path class="measured" d="M7 7l6 6M13 7l-6 6"/></svg>measured</li>)";
constexpr const char* kModelKeys =
    R"(<li><svg class="mark" aria-hidden="true"><path class="tuned" d="M1 10h18"/><path class="tuned solid" d="M10 5.5l4.5 4.5-4.5 4.5-4.5-4.5z"/></svg>tuned base model</li>
<li><svg class="mark" aria-hidden="true"><path class="final" d="M1 10h18"/><circle class="final" cx="10" cy="10" r="3.5"/></svg>final model, with effects</li>)";

std::string key(std::string_view items) {
  return fmt::format(R"(<ul class="key" aria-label="Key">{}</ul>)", items);
}

// Without scripts the plots have nothing to show; everything else is text.
constexpr const char* kNoScript =
    R"(<noscript><p class="quiet">The plots need scripts; the tables do not.</p></noscript>)";

constexpr const char* kDrivenEnds =
    R"(One picture a command, seen from where each trial began: x ahead, y to the left. An ellipse should hold nine trials in ten. As driven, there is one ellipse a condition, so a model that looks at more than the command spreads its predictions; an error takes each trial's own prediction away.)";
constexpr const char* kDrivenResiduals =
    R"(Measured minus predicted, along the axes of the predicted end pose.)";

std::string or_else(const std::string& words, const char* driven) {
  return words.empty() ? driven : html_escaped(words);
}

std::string poses_section(const Diagnosis& diagnosis) {
  return R"(<section id="poses"><h2>Measured against predicted end poses</h2>
<p>)" + or_else(diagnosis.words.ends, kDrivenEnds) +
         "</p>" + key(std::string(kMeasuredKey) + kModelKeys) +
         R"(<div class="controls" id="pose-controls"></div>
<div class="grid" id="pose-plots"></div>)" +
         kNoScript + "</section>\n";
}

std::string residuals_section(const Diagnosis& diagnosis) {
  std::string html = R"(<section id="residuals"><h2>Where the tuned model goes wrong</h2>)";
  if (diagnosis.where.empty()) {
    html += "<p>Its residuals depend on nothing that was looked at.</p>";
  } else {
    html += where_table(diagnosis.where, "Where the tuned model goes wrong");
  }
  return html + R"(<h3 id="residual-title">Residuals against what may drive them</h3>
<p>)" + or_else(diagnosis.words.residuals, kDrivenResiduals) +
         R"( Lines join the means of neighbouring trials, with 90 % intervals.</p>)" +
         key(kModelKeys) + R"(<div class="controls" id="residual-controls"></div>
<div class="grid" id="residual-plots"></div>)" +
         kNoScript + "</section>\n";
}

std::string unexplained_section(const Diagnosis& diagnosis) {
  std::string html = R"(<section id="unexplained"><h2>What stays unexplained</h2>)";
  if (diagnosis.unexplained.empty()) {
    return html +
           "<p>The final model's residuals depend on nothing that was looked at.</p></section>\n";
  }
  return html + where_table(diagnosis.unexplained, "What stays unexplained") + "</section>\n";
}

std::string data_block(const char* id, const nlohmann::ordered_json& json) {
  return fmt::format(
      "<script type=\"application/json\" id=\"{}\">{}</script>\n", id,
      script_safe(json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)));
}

// Nothing was simulated: there is nothing to plot.
std::string unusable_rest(const Diagnosis& diagnosis) {
  return cautions_section(diagnosis) + provenance_section(diagnosis) +
         "</main>\n<footer>Made by gapfarm. This page needs no network.</footer>\n" +
         data_block("diagnosis", summary_json(diagnosis)) + "</body>\n</html>\n";
}

}  // namespace

std::string report_html(const Diagnosis& diagnosis) {
  std::string html = head(diagnosis);
  html += "<body>\n";
  html += kHatches;
  html += kTop;
  html += "<main>\n" + summary_section(diagnosis) + sanity_section(diagnosis);
  if (diagnosis.verdict == Verdict::kUnusable) return html + unusable_rest(diagnosis);
  html += R"(<section id="gap"><h2>The gap, split by cause</h2>)" + gap_split_html(diagnosis) +
          "</section>\n";
  html += poses_section(diagnosis);
  html += residuals_section(diagnosis);
  html += screening_section(diagnosis);
  html += shrinkage_section(diagnosis);
  html += unexplained_section(diagnosis);
  html += next_section(diagnosis);
  html += cautions_section(diagnosis);
  html += provenance_section(diagnosis);
  html += fmt::format(
      "</main>\n<footer>Made by gapfarm; plots by {}. This page needs no network.</footer>\n",
      plot_library());
  html += data_block("diagnosis", summary_json(diagnosis));
  html += data_block("trials", trials_json(diagnosis, kPlotDigits));
  for (const std::string_view script : page_scripts()) {
    html += fmt::format("<script>{}</script>\n", script);
  }
  return html + "</body>\n</html>\n";
}

}  // namespace gapfarm
