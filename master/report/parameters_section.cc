#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "common/base/ranges.h"
#include "master/report/html.h"
#include "master/report/report_html.h"

namespace gapfarm {
namespace {

std::string value_with_unit(double value, const std::string& unit) {
  return html_escaped(with_unit(number_text(value, 4), unit));
}

// Between its bounds: where the value lies, with its interval.
std::string bounds_svg(const ParameterRow& row) {
  const double range = row.upper - row.lower;
  if (!(range > 0) || !row.choice.empty()) return "";
  const auto share = [&](double v) { return (v - row.lower) / range; };
  return interval_svg(share(row.after), share(row.lo.value_or(row.after)),
                      share(row.hi.value_or(row.after)));
}

std::string remarks(const ParameterRow& row) {
  std::string html;
  if (const BoundHit hit = bound_hit(row); hit != BoundHit::kNone) {
    const bool low = hit == BoundHit::kLower;
    html = fmt::format(R"(<strong class="warning">▲ at its {} bound, {}</strong>)",
                       low ? "lower" : "upper",
                       value_with_unit(low ? row.lower : row.upper, row.unit));
  }
  if (!row.note.empty()) html += (html.empty() ? "" : "<br>") + html_escaped(row.note);
  return html;
}

HtmlRow parameter_row(const ParameterRow& row) {
  const std::string after =
      row.choice.empty() ? value_with_unit(row.after, row.unit) : html_escaped(row.choice);
  const std::string before = !row.choice_before.empty() ? html_escaped(row.choice_before)
                             : row.before && row.choice.empty()
                                 ? value_with_unit(*row.before, row.unit)
                                 : "–";
  const std::string between =
      row.choice.empty() ? number_text(row.lower) + " to " + number_text(row.upper) : "";
  return {
      "<code>" + html_escaped(row.key) + "</code><small>" + html_escaped(row.summary) + "</small>",
      {before, "<strong>" + after + "</strong>",
       row.lo && row.hi ? number_text(*row.lo, 4) + " to " + number_text(*row.hi, 4) : "–",
       bounds_svg(row) + "<small>" + between + "</small>", remarks(row)}};
}

HtmlColumn number_column(const TermColumn& column) {
  return {term(column.term, column.shown), "number", std::string(column.shown)};
}

std::string warnings(const std::vector<ParameterRow>& rows) {
  const std::vector<std::string> keys = keys_at_bounds(rows);
  if (keys.empty()) return "";
  return "<p class=\"caution-box\">▲ At a bound: " + html_names(keys) +
         ". The search wanted to go on: widen the range where it makes sense, and trust the rest "
         "of the page less until it does not.</p>";
}

std::string correlations_html(const std::vector<ParameterCorrelation>& correlations) {
  std::string items;
  for (const ParameterCorrelation& c : correlations) {
    if (!(std::abs(c.r) >= kStrongCorrelation)) continue;
    items += fmt::format("<li><code>{}</code> and <code>{}</code>: {}</li>", html_escaped(c.a),
                         html_escaped(c.b), number_text(c.r, 2));
  }
  if (items.empty()) return "";
  return "<h3>What makes up for what</h3><p>Strong " + term("correlation", "correlations") +
         ": the log shows a combination of the two better than either.</p><ul "
         "class=\"correlations\">" +
         items + "</ul>";
}

std::string toml_value(const ParameterRow& row) {
  if (!row.choice.empty()) return '"' + row.choice + '"';
  return fmt::format("{:.6g}", row.after);
}

// Where a population lay is no interval of anything: there what `gapfarm determine` reported
// stands.
std::string toml_comment(const ParameterRow& row, bool intervals) {
  std::string text = row.unit == "-" ? "" : row.unit;
  if (!intervals && !row.note.empty()) text += (text.empty() ? "" : "; ") + row.note;
  if (intervals && row.lo && row.hi) {
    text += (text.empty() ? "" : ", ") + fmt::format("90 % {:.4g} to {:.4g}", *row.lo, *row.hi);
  }
  return text.empty() ? "" : "  # " + text;
}

}  // namespace

std::string config_snippet(const std::vector<ParameterRow>& rows, bool intervals) {
  std::string base, effects, section;
  for (const ParameterRow& row : rows) {
    if (row.effect.empty()) {
      base += row.key + " = " + toml_value(row) + toml_comment(row, intervals) + "\n";
      continue;
    }
    if (row.effect != section) effects += "\n[effects." + row.effect + "]\n";
    section = row.effect;
    effects += row.key.substr(row.key.find('.') + 1) + " = " + toml_value(row) +
               toml_comment(row, intervals) + "\n";
  }
  const std::string text = (base.empty() ? "" : "[parameters]\n" + base) + effects;
  return text.empty() || text[0] != '\n' ? text : text.substr(1);
}

std::string parameters_section(const std::vector<ParameterRow>& rows,
                               const std::vector<ParameterCorrelation>& correlations,
                               const ParameterColumns& columns, std::string_view none) {
  std::string html = R"(<section id="parameters" data-live><h2>Parameters</h2>)";
  if (rows.empty()) return html + fmt::format("<p>{}</p></section>\n", none);
  html += warnings(rows);
  html += html_table("cards parameters", "parameters", "Parameters",
                     {{"parameter"},
                      number_column(columns.before),
                      number_column(columns.after),
                      number_column(columns.interval),
                      {term("bound", "searched between"), "between", "searched between"},
                      {"remarks"}},
                     mapped(rows, parameter_row));
  html += correlations_html(correlations);
  return html +
         R"(<h3>For your config</h3><p>Paste it in place of the same keys; )"
         R"(<code>gapfarm check</code> reads it. What each effect does, for other simulators, is in docs/effects.md.</p>)"
         R"(<div class="snippet"><button type="button" class="copy" data-of="snippet" hidden>Copy</button>)"
         R"(<pre id="snippet" tabindex="0">)" +
         html_escaped(config_snippet(rows, columns.interval.term == "interval")) +
         "</pre></div></section>\n";
}

}  // namespace gapfarm
