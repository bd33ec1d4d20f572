#include "master/report/report_html.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"

namespace gapfarm {
namespace {

constexpr const char* kDrivenEnds =
    R"(One picture a command, seen from where each trial began; turns on the spot by their headings, a row a condition. An ellipse or a bar should hold nine trials in ten. As driven, there is one a condition, so a model that looks at more than the command spreads its predictions; an error takes each trial's own prediction away.)";
constexpr const char* kDrivenResiduals =
    R"(Measured minus predicted, along the axes of the predicted end pose.)";

std::string or_else(const std::string& label, const char* driven) {
  return label.empty() ? driven : html_escaped(label);
}

constexpr ModelNames kModels = {"tuned base model", "final model, with effects"};

std::string residuals_section(const Diagnosis& diagnosis) {
  std::string html = R"(<section id="residuals"><h2>Where the )" + term("tuned", "tuned model") +
                     " goes wrong</h2>";
  if (diagnosis.where.empty()) {
    html += "<p>Its residuals depend on nothing that was looked at.</p>";
  } else {
    html += where_table(diagnosis.where, "Where the tuned model goes wrong", "where");
  }
  return html + residual_plots(term("residual", "Residuals") + " against what may drive them",
                               or_else(diagnosis.labels.residuals, kDrivenResiduals), kModels);
}

std::string unexplained_section(const Diagnosis& diagnosis) {
  constexpr const char* kHeading = "What stays unexplained";
  return html_section(
      "unexplained", kHeading,
      diagnosis.unexplained.empty()
          ? "<p>The final model's residuals depend on nothing that was looked at.</p>"
          : where_table(diagnosis.unexplained, kHeading, "unexplained"));
}

std::string shape_section(const Diagnosis& diagnosis) {
  if (!diagnosis.residual && diagnosis.nearest.empty()) return "";
  std::string html;
  if (diagnosis.residual) html += "<p>" + html_escaped(diagnosis.residual->text) + "</p>";
  if (diagnosis.residual && !diagnosis.residual->correction.field.empty()) {
    html += plot_grid("shape");
  }
  if (!diagnosis.nearest.empty()) {
    html += "<h3>What comes nearest, and why it is not the cause</h3>" +
            html_list(mapped(diagnosis.nearest, &NearMiss::text));
  }
  return html_section("shape", "The shape of what nothing explains", html);
}

constexpr std::array<GapUnit, 3> kUnits = {GapUnit::kNats, GapUnit::kMillimetres,
                                           GapUnit::kMilliradians};
constexpr double kLeastScaleNats = 0.2;
constexpr int kHatchCount = 5;  // as many as the page defines

// In the order of GapUnit.
struct UnitRow {
  const char* title;
  const char* unit;
  GapFigures Diagnosis::*figures;
};
constexpr UnitRow kUnitRows[] = {{"Log score lost a trial", "nats", &Diagnosis::gap},
                                 {"Position, root mean square", "mm", &Diagnosis::position_mm},
                                 {"Heading, root mean square", "mrad", &Diagnosis::heading_mrad}};

const UnitRow& row_of(GapUnit unit) { return kUnitRows[static_cast<std::size_t>(unit)]; }

std::optional<double> level_after(const NamedEffect& effect, GapUnit unit) {
  return unit == GapUnit::kNats          ? effect.gap_after
         : unit == GapUnit::kMillimetres ? effect.position_mm_after
                                         : effect.heading_mrad_after;
}

// Hatch and badge of a part; effects count from 1.
struct Look {
  std::string hatch;
  std::string badge;
};

Look look(const GapPart& part, int effect) {
  if (part.kind == GapPart::Kind::kFloor) return {"floor", "F"};
  if (part.kind == GapPart::Kind::kUnnamed) return {"unexplained", "?"};
  return {std::to_string((effect - 1) % kHatchCount + 1), std::to_string(effect)};
}

// A stretch of a bar.
struct Stretch {
  double length = 0;
  Look look;
  std::string label;
};

double above_zero(double amount) { return std::isfinite(amount) ? std::max(amount, 0.0) : 0; }

// The parts of one bar, which add up to the tuned gap before and to the final one after.  What an
// effect made worse was not there before and is afterwards.
std::vector<Stretch> stretches(const GapSplit& split, bool before) {
  double worse = 0;
  for (const GapPart& part : split.parts) {
    if (part.kind == GapPart::Kind::kEffect) worse += above_zero(-part.amount);
  }
  if (split.parts.size() == 2) worse = 0;
  std::vector<Stretch> list;
  int effect = 0;
  for (const GapPart& part : split.parts) {
    const bool is_effect = part.kind == GapPart::Kind::kEffect;
    if (is_effect) ++effect;
    const double amount = part.kind == GapPart::Kind::kUnnamed ? part.amount - worse : part.amount;
    const Look own = look(part, effect);
    if (!is_effect || before) list.push_back({above_zero(amount), own, part.label});
    if (is_effect && !before) {
      list.push_back(
          {above_zero(-part.amount), {"worse", "+" + own.badge}, part.label + " made it worse"});
    }
  }
  return list;
}

double drawn_total(const GapSplit& split, bool before) {
  return sum_of(stretches(split, before), &Stretch::length);
}

// One stacked bar; its parts also stand in the table below, so it is hidden from screen readers.
std::string stacked_bar(const GapSplit& split, bool before, double scale) {
  std::string svg =
      R"(<svg class="stack" aria-hidden="true"><rect class="track" width="100%" height="100%"/>)";
  double at = 0;
  for (const Stretch& stretch : stretches(split, before)) {
    const double width = scale > 0 ? 100 * stretch.length / scale : 0;
    if (width <= 0) continue;
    svg += fmt::format(
        R"svg(<svg x="{:.3f}%" width="{:.3f}%"><rect class="part" fill="url(#hatch-{})" width="100%" height="100%"/>)svg",
        at, width, stretch.look.hatch);
    // A name is drawn where the bar is certainly wide enough for it, a badge where that fits.
    const double share = width / 100;
    const auto middle = [&](const char* css_class, const std::string& label) {
      svg += fmt::format(R"(<text class="{}" x="50%" y="50%">{}</text>)", css_class, label);
    };
    if (share > 0.03 + 0.0135 * static_cast<double>(stretch.label.size())) {
      middle("wide", html_escaped(stretch.label));
      middle("narrow", stretch.look.badge);
    } else if (share > 0.05) {
      middle("badge", stretch.look.badge);
    }
    svg += "</svg>";
    at += width;
  }
  return svg + "</svg>";
}

std::string bars(const GapSplit& split) {
  // A gap of next to nothing shall not fill the bar.
  const double least = split.unit == GapUnit::kNats ? kLeastScaleNats : 0;
  const double scale = std::max({drawn_total(split, true), drawn_total(split, false), least});
  const UnitRow& w = row_of(split.unit);
  return fmt::format(
      R"(<div class="split"><h3>{}</h3>)"
      R"(<div class="split-row"><span class="split-name">before</span>{}<span class="split-value">{} {}</span></div>)"
      R"(<div class="split-row"><span class="split-name">after</span>{}<span class="split-value">{} {}</span></div></div>)",
      w.title, stacked_bar(split, true, scale), number_text(split.tuned), w.unit,
      stacked_bar(split, false, scale), number_text(split.final_), w.unit);
}

// With what a sign other than the usual one means.
std::string amount_text(const GapPart& part, const GapSplit& split) {
  const std::string text = number_text(part.amount);
  if (!(part.amount < 0)) return text;
  if (part.kind == GapPart::Kind::kEffect) {
    return text + R"( <small class="worse">▲ worse</small>)";
  }
  const bool little = std::abs(part.amount) < 0.1 * std::abs(split.tuned);
  return text + (little ? " <small>within the floor</small>" : " <small>below the floor</small>");
}

// Rows in the order of the cause of most interest: effects, unexplained, floor.
std::string parts_table(const std::vector<GapSplit>& splits) {
  const auto& parts = splits.front().parts;
  std::vector<std::pair<const GapPart*, int>> order;
  int effect = 0;
  for (const GapPart& part : parts) {
    if (part.kind == GapPart::Kind::kEffect) order.emplace_back(&part, ++effect);
  }
  order.emplace_back(&parts[1], 0);
  order.emplace_back(&parts[0], 0);
  std::vector<HtmlRow> rows;
  for (const auto& [part, number] : order) {
    const Look l = look(*part, number);
    rows.push_back(
        {fmt::format(
             R"svg(<svg class="swatch" aria-hidden="true"><rect class="part" fill="url(#hatch-{})" width="100%" height="100%"/>)svg"
             R"(<text class="badge" x="50%" y="50%">{}</text></svg>{})",
             l.hatch, l.badge, html_escaped(part->label)),
         {}});
    for (const GapSplit& split : splits) {
      const GapPart* same = find_by(split.parts, part->label, &GapPart::label);
      rows.back().cells.push_back(same ? amount_text(*same, split) : "with the others");
    }
  }
  rows.push_back({"tuned model, in all", {}, "sum"});
  for (const GapSplit& split : splits) rows.back().cells.push_back(number_text(split.tuned));
  return html_table("parts", "gap", "The gap by cause",
                    {{"part"},
                     {"nats a trial", "number", "nats"},
                     {"position, mm", "number", "mm"},
                     {"heading, mrad", "number", "mrad"}},
                    rows);
}

}  // namespace

std::string report_html(const Diagnosis& diagnosis, bool served) {
  PageFrame frame;
  frame.title = diagnosis.headline.empty() ? "gapfarm diagnosis" : diagnosis.headline;
  frame.brand = "diagnosis";
  frame.served = served;
  const bool driven = diagnosis.labels.ends.empty();
  Json page = summary_json(diagnosis);
  page["drives"] = drives_json(diagnosis.drives);
  page["models"] = {{"tuned", "tuned"}, {"final", "final"}};
  page["without_trials"] = "This diagnosis was kept without its trials.";
  const Json trials = trials_json(diagnosis, kPlotDigits);
  if (diagnosis.verdict == Verdict::kUnusable) {
    // Nothing was simulated: there is nothing to plot.
    frame.places = {{"sanity", "Doubts"}, {"provenance", "Inputs"}};
    frame.body = summary_section(diagnosis) + sanity_section(diagnosis) +
                 cautions_section(diagnosis) + provenance_section(diagnosis);
    return framed_page(frame, page, trials);
  }
  frame.body = summary_section(diagnosis) + sanity_section(diagnosis);
  frame.add("gap", "Gap",
            html_section("gap", "The " + term("gap", "gap") + ", split by cause",
                         gap_split_html(diagnosis)));
  frame.add(
      "parameters", "Parameters",
      parameters_section(diagnosis.parameters, diagnosis.correlations,
                         {{"tuned", "tuned"}, {"final", "final"}, {"interval", "90 % interval"}},
                         "None of a config: nothing was named, or what was named stands in "
                         "robot.toml beside this page."));
  if (driven) {
    frame.add("floor", "Floor", floor_section());
    frame.add("drives", "Drives", drives_section({"tuned model", "final model"}));
  }
  frame.add("poses", "Poses",
            poses_section("Measured against predicted end poses",
                          or_else(diagnosis.labels.ends, kDrivenEnds), kModels));
  frame.add("residuals", "Residuals", residuals_section(diagnosis));
  frame.add("screening", "Catalogue", screening_section(diagnosis));
  frame.add("shrinkage", "Shrinkage", shrinkage_section(diagnosis));
  frame.body += unexplained_section(diagnosis);
  frame.add("shape", "Shape", shape_section(diagnosis));
  frame.add("next", "Next", next_section(diagnosis));
  frame.body += cautions_section(diagnosis);
  frame.add("provenance", "Inputs", provenance_section(diagnosis));
  return framed_page(frame, page, trials);
}

GapSplit split_gap(const Diagnosis& diagnosis, GapUnit unit) {
  const GapFigures& f = diagnosis.*row_of(unit).figures;
  GapSplit split{unit, f.tuned, f.final_, {}};
  split.parts.push_back({GapPart::Kind::kFloor, "floor (repeats of a trial)", f.floor});
  split.parts.push_back({GapPart::Kind::kUnnamed, "unexplained", f.final_ - f.floor});
  const auto& effects = diagnosis.effects;
  if (effects.empty()) {
    split.parts[1].amount = f.tuned - f.floor;
    return split;
  }
  bool measured = true;
  for (std::size_t i = 0; i + 1 < effects.size(); ++i) {
    const auto level = level_after(effects[i], unit);
    measured = measured && level && std::isfinite(*level);
  }
  if (!measured) {
    split.parts.push_back({GapPart::Kind::kEffect, "effects together", f.tuned - f.final_});
    return split;
  }
  double level = f.tuned;
  for (std::size_t i = 0; i < effects.size(); ++i) {
    const double after = i + 1 == effects.size() ? f.final_ : *level_after(effects[i], unit);
    split.parts.push_back({GapPart::Kind::kEffect, effects[i].name, level - after});
    level = after;
  }
  return split;
}

std::string gap_split_html(const Diagnosis& diagnosis) {
  std::vector<GapSplit> splits;
  std::string html;
  for (const GapUnit unit : kUnits) {
    splits.push_back(split_gap(diagnosis, unit));
    html += bars(splits.back());
  }
  return R"(<figure class="gap-split"><div class="splits">)" + html + "</div><figcaption>" +
         "Before: the tuned base model. After: the " + term("final", "final model") +
         ", with the named effects. An effect's part is how much the gap fell when it was added, "
         "in "
         "the order found, on " +
         term("held-out", "trials that the fit did not see") +
         "; one that made it worse lengthens the bar after. The " + term("floor", "floor") +
         " is what repeating a trial in reality varies by; the log score is counted from it, in " +
         term("nat", "nats a trial") + ".</figcaption></figure>" + parts_table(splits);
}

}  // namespace gapfarm
