#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "master/report/html.h"
#include "master/report/report_html.h"

namespace gapfarm {
namespace {

struct VerdictLabels {
  const char* css_class;
  const char* sign;
  const char* title;
  const char* meaning;  // when the diagnosis has no headline of its own
};

// In the order of Verdict.
constexpr VerdictLabels kVerdicts[] = {
    {"verdict-effect", "◆", "Effect found", "A known effect explains the gap."},
    {"verdict-none", "●", "No effect", "The tuned simulation is as good as these data can show."},
    {"verdict-unknown", "▲", "Cause unknown",
     "There is a gap, and nothing in the catalogue explains it."},
    {"verdict-both", "◆▲", "Effect found, more remains",
     "A known effect explains a part of the gap; something else is there too."},
    {"verdict-unusable", "✕", "Not usable as it is",
     "Something is wrong with the log or with its config; nothing was simulated."}};

std::string tile(const std::string& title, const GapFigures& figures, bool changed,
                 const std::string& unit) {
  return html_tile(
      title, changed ? number_text(figures.tuned) : "",
      number_text(changed ? figures.final_ : figures.tuned), unit,
      "<small>" + term("floor", "floor") + " " + number_text(figures.floor) + "</small>");
}

// A bar with its number.
std::string meter(double share, const char* css_class, const std::string& number) {
  return R"(<span class="meter">)" + bar_svg(share, css_class) + "<span>" + number +
         "</span></span>";
}

// A dependence that makes nothing worse, less scatter than was allowed, say, has no bar.
std::string share_text(double share) {
  if (std::isfinite(share) && share < 0.005) return "under 1 %";
  return meter(share, "fill", percent_text(share));
}

std::string estimates(const NamedEffect& effect) {
  std::vector<HtmlRow> rows = mapped(effect.parameters, [](const Estimate& e) {
    return HtmlRow{"<code>" + html_escaped(e.key) + "</code>",
                   {html_escaped(with_unit(number_text(e.value), e.unit)),
                    number_text(e.lo) + " to " + number_text(e.hi)}};
  });
  if (!effect.axis.empty()) rows.push_back({"<code>axis</code>", {html_escaped(effect.axis), ""}});
  if (rows.empty()) return "";
  return html_table("plain", "", "Estimates of " + effect.name,
                    {{"parameter"}, {"estimate", "number"}, {"90 % interval", "number"}}, rows);
}

// "66 → 58.6 mm", or a dash where it was not measured.
std::string step_text(std::optional<double> before, std::optional<double> after, const char* unit) {
  if (!before || !after) return "–";
  return fmt::format("{} → {} {}{}", number_text(*before), number_text(*after), unit,
                     *after > *before ? R"( <small class="worse">▲ worse</small>)" : "");
}

std::string confidence_text(double confidence) {
  return confidence > 0.99 ? "over 99 %" : percent_text(confidence);
}

std::string effect_card(const NamedEffect& effect, std::size_t number) {
  std::string html = fmt::format(
      R"(<article class="effect"><h3><span class="count">{}</span> <code>{}</code></h3>)", number,
      html_escaped(effect.name));
  if (!effect.text.empty()) html += "<p>" + html_escaped(effect.text) + "</p>";
  html += fmt::format(
      R"(<div class="closed"><span class="closed-value">{} <strong>{}</strong> of the gap)"
      R"(<small>{} {} to {}</small></span>{}<span class="scale" aria-hidden="true"><span>0 %</span><span>50 %</span><span>100 %</span></span></div>)",
      term("closed", "closes"), percent_text(effect.closed), term("interval", "90 % interval"),
      percent_text(effect.closed_lo), percent_text(effect.closed_hi),
      interval_svg(effect.closed, effect.closed_lo, effect.closed_hi));
  html += fmt::format(
      R"(<dl class="facts"><div><dt>gap, {}</dt><dd>{} → {} {}</dd></div><div><dt>{}</dt><dd>{}</dd></div>)"
      R"(<div><dt>position, rms</dt><dd>{}</dd></div><div><dt>heading, rms</dt><dd>{}</dd></div>)",
      term("held-out", "held out"), number_text(effect.gap_before), number_text(effect.gap_after),
      term("nat", "nats/trial"), term("confidence", "confidence"),
      confidence_text(effect.confidence),
      step_text(effect.position_mm_before, effect.position_mm_after, "mm"),
      step_text(effect.heading_mrad_before, effect.heading_mrad_after, "mrad"));
  if (!effect.aliases.empty()) {
    html += R"(<div class="wide"><dt>or, just as well on these data</dt><dd>)" +
            html_names(effect.aliases);
    if (!effect.alias_reason.empty()) {
      html += "<br><small>" + html_escaped(effect.alias_reason) + "</small>";
    }
    html += "</dd></div>";
  }
  return html + "</dl>" + estimates(effect) + "</article>";
}

bool is_named(const Diagnosis& diagnosis, const std::string& effect) {
  return contains(diagnosis.effects, effect, &NamedEffect::name);
}

// "◆ named", "◇ instead of floor_tilt", or nothing.
std::string standing(const Diagnosis& diagnosis, const std::string& effect) {
  for (const NamedEffect& e : diagnosis.effects) {
    if (e.name == effect) return R"( <span class="tag">◆ named</span>)";
    if (contains(e.aliases, effect)) {
      return R"( <span class="tag">◇ or instead of )" + html_escaped(e.name) + "</span>";
    }
  }
  return "";
}

HtmlRow screened_row(const Diagnosis& diagnosis, const Screened& s, double largest) {
  const bool named = is_named(diagnosis, s.effect);
  std::string note = html_escaped(s.note);
  if (!s.alias_set.empty()) {
    note = "<span>looks like " + html_names(s.alias_set) + (note.empty() ? "" : "<br>") + note +
           "</span>";
  }
  const std::string from = joined(s.detectable_from, ", ", [](const auto& size) {
    return size.first + " " + number_text(size.second);
  });
  return {"<code>" + html_escaped(s.effect) + "</code>" + standing(diagnosis, s.effect),
          {meter(largest > 0 ? s.gain / largest : 0, named ? "fill-named" : "fill",
                 number_text(s.gain)),
           p_text(s.p), html_escaped(s.estimate), from.empty() ? "–" : html_escaped(from), note},
          named ? "named" : ""};
}

}  // namespace

std::string summary_section(const Diagnosis& diagnosis) {
  const VerdictLabels& labels = kVerdicts[static_cast<std::size_t>(diagnosis.verdict)];
  std::string html = fmt::format(
      R"(<section id="summary"><p class="verdict {}"><span aria-hidden="true">{}</span> {}</p><h1 data-file="diagnosis">{}</h1>)",
      labels.css_class, labels.sign, labels.title,
      html_escaped(diagnosis.headline.empty() ? labels.meaning : diagnosis.headline));
  if (!diagnosis.action.empty()) {
    html += R"(<p class="action"><span aria-hidden="true">→</span> )" +
            html_escaped(diagnosis.action) + "</p>";
  }
  const bool changed = !diagnosis.effects.empty();
  if (diagnosis.verdict == Verdict::kUnusable) return html + "</section>";
  html += R"(<dl class="tiles">)" +
          tile(term("gap", "Gap") + ", " + term("held-out", "held out"), diagnosis.gap, changed,
               term("nat", "nats/trial")) +
          tile("Position, " + term("rms", "rms"), diagnosis.position_mm, changed, "mm") +
          tile("Heading, " + term("rms", "rms"), diagnosis.heading_mrad, changed, "mrad") + "</dl>";
  if (!diagnosis.findings.empty()) html += html_list(diagnosis.findings, "long");
  if (!diagnosis.cautions.empty()) {
    html += fmt::format(
        R"(<p class="caution-link">▲ <a href="#cautions">{} caution{}</a> to read before relying on this.</p>)",
        diagnosis.cautions.size(), diagnosis.cautions.size() == 1 ? "" : "s");
  }
  return html + "</section>";
}

std::string sanity_section(const Diagnosis& diagnosis) {
  if (diagnosis.sanity.empty()) return "";
  std::string items;
  for (const SanityFinding& f : diagnosis.sanity) {
    items += "<li><p><code>" + html_escaped(f.name) + "</code>: " + html_escaped(f.text) +
             "</p><p><strong>What to do:</strong> " + html_escaped(f.remedy) + "</p></li>";
  }
  return html_section("sanity", "Data-quality warnings",
                      R"(<ul class="cautions">)" + items + "</ul>");
}

std::string where_table(const std::vector<Where>& findings, const char* caption, const char* file) {
  std::vector<HtmlRow> rows;
  for (const Where& w : findings) {
    const char* unit = w.component == "theta" ? "mrad" : "mm";
    rows.push_back(
        {html_escaped(w.text) +
             fmt::format(
                 R"(<button type="button" class="show" hidden data-command="{}" data-component="{}" data-covariate="{}">Show in the plots</button>)",
                 html_escaped(w.command), html_escaped(w.component), html_escaped(w.covariate)),
         {html_escaped(w.command), html_escaped(w.component + " " + w.kind),
          w.covariate.empty() ? "–" : html_escaped(w.covariate),
          number_text(w.size, 2) + " " + unit, share_text(w.share), p_text(w.p)}});
  }
  return html_table("cards findings", file, caption,
                    {{"finding"},
                     {"command"},
                     {term("trend", "part"), "", "part"},
                     {"depends on"},
                     {"size", "number"},
                     {term("share", "share of the gap"), "number with-bar", "share"},
                     {term("p", "p, corrected"), "number", "p"}},
                    rows);
}

std::string screening_section(const Diagnosis& diagnosis) {
  if (diagnosis.screening.empty()) return "";
  std::vector<const Screened*> order;
  double largest = 0;
  for (const Screened& s : diagnosis.screening) {
    order.push_back(&s);
    if (std::isfinite(s.gain)) largest = std::max(largest, s.gain);
  }
  // A gain that is not a number sorts last, so that the comparison stays an order.
  const auto key = [](const Screened* s) { return std::isfinite(s->gain) ? s->gain : -1e300; };
  std::ranges::stable_sort(order, [&](const auto* a, const auto* b) { return key(a) > key(b); });
  const auto rows =
      mapped(order, [&](const Screened* s) { return screened_row(diagnosis, *s, largest); });
  return html_section(
      "screening", "Which effect: the whole catalogue",
      R"(<p>What each effect could add to the )"
      R"(tuned model once everything that retuning absorbs is taken out. The p-value is against that effect's own luck )"
      R"(on data with nothing to find. Effects that look alike leave parallel traces in these data. From the sizes in the last but )"
      R"(one column on, each alone, this log would name an effect with 95 % power, by slopes at the fit.</p>)" +
          html_table("cards screening", "catalogue", "Screening of the catalogue",
                     {{"effect"},
                      {term("gain", "gain, nats in all"), "number with-bar", "gain, nats"},
                      {"p", "number"},
                      {"best strength"},
                      {"would be named from"},
                      {"remarks"}},
                     rows));
}

std::string shrinkage_section(const Diagnosis& diagnosis) {
  constexpr const char* kHeading = "How far the gap shrinks";
  if (diagnosis.effects.empty()) {
    return html_section("shrinkage", kHeading, "<p>No effect was added, so nothing shrinks.</p>");
  }
  std::string html =
      R"(<p>On trials that the fit did not see; the interval is from resampling sessions or blocks of trials.</p><div class="effects">)";
  for (std::size_t i = 0; i < diagnosis.effects.size(); ++i) {
    html += effect_card(diagnosis.effects[i], i + 1);
  }
  return html_section("shrinkage", kHeading, html + "</div>");
}

std::string next_section(const Diagnosis& diagnosis) {
  if (diagnosis.next.empty()) {
    return html_section("next", "What to try next", "<p>Nothing in particular.</p>");
  }
  std::string html = R"(<ol class="next">)";
  for (const NextExperiment& n : diagnosis.next) {
    html += "<li><p>" + html_escaped(n.text) + "</p>";
    if (!n.separates.empty()) {
      html += "<p class=\"detail\">" +
              (n.separates.size() > 1 ? "separates " + html_names(n.separates, " from ")
                                      : "shows " + html_names(n.separates)) +
              "</p>";
    }
    if (n.trials > 0) {
      html +=
          fmt::format(R"(<p class="detail">about <strong>{}</strong> trials for 95 % power</p>)",
                      number_text(static_cast<double>(n.trials)));
    }
    html += "</li>";
  }
  return html_section("next", "What to try next", html + "</ol>");
}

std::string cautions_section(const Diagnosis& diagnosis) {
  if (diagnosis.cautions.empty()) return "";
  return html_section("cautions", "Cautions", html_list(diagnosis.cautions, "cautions"));
}

std::string provenance_section(const Diagnosis& diagnosis) {
  std::string html;
  if (!diagnosis.provenance.empty()) html = html_definitions(diagnosis.provenance);
  double total = 0;
  for (const auto& [stage, seconds] : diagnosis.timing_s) {
    if (std::isfinite(seconds)) total += seconds;
  }
  if (total > 0) {
    std::vector<HtmlRow> rows = mapped(diagnosis.timing_s, [&](const auto& stage) {
      return HtmlRow{html_escaped(stage.first),
                     {bar_svg(stage.second / total, "fill"), number_text(stage.second)}};
    });
    rows.push_back({"in all", {"", number_text(total)}, "sum"});
    html += "<h3>Time</h3>" + html_table("plain timing", "", "Wall time by stage",
                                         {{"stage"}, {"share"}, {"s", "number"}}, rows);
  }
  return html_section("provenance", "What went in", html);
}

}  // namespace gapfarm
