// The influence of parameters as text, CSV and genes.
#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "master/experiments/influence/influence.h"

namespace gapfarm {
namespace {

std::string distance_text(double distance_m) {
  return distance_m >= 1e5 ? std::string("fails") : fmt::format("{:.3g}", distance_m);
}

std::string interval_text(const Interval& interval) {
  if (std::isnan(interval.lower)) return "-";
  return distance_text(interval.lower) + " to " + distance_text(interval.upper);
}

// The value without its unit, as TOML has it.
std::string toml_value(const ParameterTable& table, std::size_t row, double value) {
  const std::string text = table.text_of(row, value);
  return table[row].kind == ParameterKind::kChoice ? '"' + text + '"' : text;
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
