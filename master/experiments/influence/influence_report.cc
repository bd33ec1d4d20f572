// The influence of parameters as text, CSV, page and genes.
#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "common/base/ranges.h"
#include "master/experiments/influence/influence.h"
#include "master/report/figures/figures.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"

namespace gapfarm {
namespace {

std::string distance_text(double distance_m) {
  return distance_m >= 1e5 ? std::string("fails") : fmt::format("{:.3g}", distance_m);
}

std::string interval_text(const Interval& interval) {
  if (std::isnan(interval.lower)) return "-";
  return distance_text(interval.lower) + " to " + distance_text(interval.upper);
}

std::string gene_range(const Gene& gene, const ParameterTable& table) {
  return table.format(gene.row, gene.lower) + " to " + table.format(gene.row, gene.upper);
}

// The value without its unit, as TOML has it.
std::string toml_value(const ParameterTable& table, std::size_t row, double value) {
  const std::string text = table.text_of(row, value);
  return table[row].kind == ParameterKind::kChoice ? '"' + text + '"' : text;
}

// The furthest on top.  What is beyond all bounds is omitted.
LineChart distances_chart(const InfluenceReport& report, const ParameterTable& table,
                          Influence FactorInfluence::*method, double repeats) {
  constexpr double kMost_m = 1e5, kRow = 22;
  LineChart chart;
  std::vector<FactorInfluence> factors = report.factors;
  std::ranges::stable_sort(
      factors, {}, [&](const FactorInfluence& factor) { return (factor.*method).distance; });
  for (const FactorInfluence& factor : factors) {
    const Influence& of = factor.*method;
    if (of.distance >= kMost_m) continue;
    const double y = static_cast<double>(chart.y_names.size());
    chart.y_names.push_back(table[factor.gene.row].key);
    const std::string name = of.influential ? "influential" : "not distinguished from repeats";
    ChartSeries series{.marks = {{of.distance, y, NAN}},
                       .colour = of.influential ? "#0072b2" : "#999999"};
    if (!contains(chart.series, name, &ChartSeries::name)) series.name = name;
    if (std::isfinite(of.distance_95.lower)) {
      series.line = {{of.distance_95.lower, y}, {std::min(of.distance_95.upper, kMost_m), y}};
    }
    chart.series.push_back(std::move(series));
  }
  const double rows = static_cast<double>(chart.y_names.size());
  chart.height = kRow * (rows + 1);
  chart.series.push_back({.name = "repeats",
                          .line = {{repeats, -0.5}, {repeats, rows - 0.5}},
                          .colour = "#d55e00",
                          .dashed = true});
  return chart;
}

}  // namespace

std::string influence_text(const InfluenceReport& report, const ParameterTable& table) {
  std::string text = fmt::format(
      "paths are compared over the first {:.3g} s, where repeats of the standard are {:.3g} m "
      "apart (95 %: {})\n\n{:<24} {:>9} {:>20} {:>9} {:>8}   {:>9} {:>20} {:>9} {:>8}\n",
      report.horizon_s, report.repeat_distance, interval_text(report.repeat_95), "alone: m further",
      "median", "95 %", "at", "p", "Morris", "95 %", "sigma", "p");
  for (const FactorInfluence& f : report.factors) {
    text += fmt::format("{:<24} {:>9} {:>20} {:>9.3g} {:>8.1g} {} {:>9} {:>20} {:>9} {:>8.1g} {}\n",
                        table[f.gene.row].key, distance_text(f.alone.distance),
                        interval_text(f.alone.distance_95), f.level, f.alone.p,
                        f.alone.influential ? '*' : ' ', distance_text(f.morris.distance),
                        interval_text(f.morris.distance_95), distance_text(f.sigma), f.morris.p,
                        f.morris.influential ? '*' : ' ');
  }
  if (std::ranges::none_of(report.factors, &FactorInfluence::influential)) {
    return text +
           "\nnone is shown to move the path further than repeats do (5 % over all "
           "parameters), so genes.toml is empty; more --repeats and --trajectories show more\n";
  }
  return text + "\n* moves the path further than repeats do, at 5 % over all parameters\n";
}

std::string influence_csv(const InfluenceReport& report, const ParameterTable& table) {
  std::string text =
      "parameter,lower,upper,alone_value,alone_distance_m,alone_low_95,alone_high_95,alone_p,alone_"
      "influential,alone_failures,morris_mean_m,morris_low_95,morris_high_95,morris_sigma_m,morris_"
      "p,morris_influential,morris_failures,repeat_distance_m,horizon_s\n";
  for (const FactorInfluence& f : report.factors) {
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n",
                        table[f.gene.row].key, f.gene.lower, f.gene.upper, f.level,
                        f.alone.distance, f.alone.distance_95.lower, f.alone.distance_95.upper,
                        f.alone.p, f.alone.influential ? 1 : 0, f.alone.failures, f.morris.distance,
                        f.morris.distance_95.lower, f.morris.distance_95.upper, f.sigma, f.morris.p,
                        f.morris.influential ? 1 : 0, f.morris.failures, report.repeat_distance,
                        report.horizon_s);
  }
  return text;
}

std::string influence_page(const InfluenceReport& report, const ParameterTable& table,
                           const InfluenceSettings& settings, const std::string& title) {
  PlainPage page(title);
  page.paragraph(fmt::format(
      "Distances between paths ({}) over the first {} s. A parameter counts as influential when it "
      "moves the path further than repeating the run does: Mann-Whitney test, adjusted by Holm "
      "over the parameters, level {}.",
      kPathDistances[settings.distance].name, number_text(report.horizon_s), settings.alpha));
  page.heading("How far ahead paths can be compared");
  page.paragraph(
      "Tiny differences at the start grow with every collision. Beyond the horizon repeats of the "
      "same run are as far apart as anything, and no parameter could be distinguished from "
      "chance.");
  LineChart growth;
  growth.title = "Repeats of the standard";
  growth.x_title = "s compared";
  growth.y_title = "m, median over pairs of repeats";
  growth.log_y = true;
  ChartSeries apart{.name = "apart"};
  ChartSeries allowed{.name = "allowed share of the path's extent"};
  for (const HorizonPoint& point : report.horizons) {
    apart.line.push_back({point.horizon_s, point.repeat_distance});
    allowed.line.push_back({point.horizon_s, settings.chaos_share * point.extent});
  }
  growth.series = {apart, allowed};
  page.picture(line_chart(growth), growth.title);
  std::vector<std::vector<std::string>> alone, morris;
  for (const FactorInfluence& f : report.factors) {
    const auto row = [&](const Influence& of, std::vector<std::string> more) {
      std::vector<std::string> cells = {table[f.gene.row].key,         distance_text(of.distance),
                                        interval_text(of.distance_95), p_text(of.p),
                                        of.influential ? "yes" : "no", std::to_string(of.failures)};
      cells.insert(cells.begin() + 1, more.begin(), more.end());
      return cells;
    };
    alone.push_back(row(f.alone, {gene_range(f.gene, table), table.format(f.gene.row, f.level)}));
    morris.push_back(row(f.morris, {distance_text(f.sigma)}));
  }
  page.heading("One parameter at a time");
  LineChart distances =
      distances_chart(report, table, &FactorInfluence::alone, report.repeat_distance);
  distances.title = "Furthest level of each parameter";
  distances.x_title = "m from the standard's path, median and 95 %";
  page.picture(line_chart(distances), distances.title);
  page.table(
      {"parameter", "range", "furthest at", "m", "95 %", "p", "influential", "runs that failed"},
      alone);
  page.heading("Morris: one parameter a step, all over the box");
  distances = distances_chart(report, table, &FactorInfluence::morris, report.box_repeat_distance);
  distances.title = "Mean distance a step of two thirds of the range moves the path";
  distances.x_title = "m, mean and 95 %";
  page.picture(line_chart(distances), distances.title);
  page.table({"parameter", "sigma, m", "mean, m", "95 %", "p", "influential", "runs that failed"},
             morris);
  return page.finish();
}

std::string influential_genes(const InfluenceReport& report, const ParameterTable& table) {
  std::string text =
      "# Parameters that move the path further than repeats do, most influential first.\n[genes]\n";
  for (const FactorInfluence& f : report.factors) {
    if (!f.influential()) continue;
    const Parameter& parameter = table[f.gene.row];
    std::string range = "[" + toml_value(table, f.gene.row, f.gene.lower) + ", " +
                        toml_value(table, f.gene.row, f.gene.upper) + "]";
    if (parameter.kind == ParameterKind::kChoice) {
      range = "[";
      for (double choice = f.gene.lower; choice <= f.gene.upper; ++choice) {
        range += (range.size() > 1 ? ", " : "") + toml_value(table, f.gene.row, choice);
      }
      range += "]";
    }
    text += parameter.key + " = " + range;
    if (parameter.unit != "-") text += "  # " + parameter.unit;
    text += "\n";
  }
  return text;
}

}  // namespace gapfarm
