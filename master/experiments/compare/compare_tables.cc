// The comparison as text and CSV.
#include <spdlog/fmt/fmt.h>

#include <cmath>

#include "master/experiments/compare/summary.h"

namespace gapfarm {
namespace {

std::string number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : ""; }
std::string number(const std::optional<double>& value) { return value ? number(*value) : ""; }

// Names come from files: no commas or quotes may break a line.
std::string field(const std::string& text) {
  std::string safe = "\"";
  for (const char c : text) safe += c == '"' ? std::string("\"\"") : std::string(1, c);
  return safe + "\"";
}

}  // namespace

std::string comparison_text(const ComparisonSummary& summary) {
  std::size_t width = 20;
  for (const VariantSummary& v : summary.variants) width = std::max(width, v.name.size());
  std::string text = fmt::format("{:<{}}  {:>10}  {:>22}  {:>5}", summary.fitness, width, "median",
                                 "95 % of the median", "rank");
  if (summary.target) text += fmt::format("  {:>9}  {:>9}  {:>9}", "success", "median to", "ERT");
  text += "\n";
  for (const VariantSummary& v : summary.variants) {
    text += fmt::format("{:<{}}  {:>10.4g}  {:>22}  {:>5.2f}", v.name, width, v.median,
                        fmt::format("{:.4g} to {:.4g}", v.median_95.lower, v.median_95.upper),
                        v.mean_rank);
    if (summary.target) {
      const auto whole = [](const std::optional<double>& value) {
        return value ? fmt::format("{:.0f}", *value) : std::string("-");
      };
      text += fmt::format("  {:>9}  {:>9}  {:>9}", fmt::format("{}/{}", v.successes, summary.seeds),
                          whole(v.median_to_target), whole(v.expected_to_target));
    }
    text += "\n";
  }
  for (const Baseline& baseline : summary.baselines) {
    text += fmt::format("{:<{}}  {:>10}\n", baseline.name, width,
                        baseline.fitness ? fmt::format("{:.4g}", *baseline.fitness) : "-");
  }
  if (summary.variants.size() > 1) {
    text += fmt::format("all alike? Friedman over seeds: chi-square {:.3g}, p = {:.2g}\n",
                        summary.all.statistic, summary.all.p);
  }
  return text;
}

std::string summary_csv(const ComparisonSummary& summary) {
  std::string text =
      "variant,runs,median,median_low_95,median_high_95,mean_rank,successes,success_low_95,"
      "success_high_95,median_evaluations_to_target,expected_evaluations_to_target";
  for (const VariantSummary& v : summary.variants) text += "," + field("p_holm " + v.name);
  text += "\n";
  for (std::size_t i = 0; i < summary.variants.size(); ++i) {
    const VariantSummary& v = summary.variants[i];
    text += fmt::format("{},{},{},{},{},{},", field(v.name), summary.seeds, number(v.median),
                        number(v.median_95.lower), number(v.median_95.upper), v.mean_rank);
    if (summary.target) {
      text += fmt::format("{},{},{},{},{}", v.successes, v.success_95.lower, v.success_95.upper,
                          number(v.median_to_target), number(v.expected_to_target));
    } else {
      text += ",,,,";
    }
    for (const double p : summary.pair_p[i]) text += "," + number(p);
    text += "\n";
  }
  const std::string blanks(9 + summary.variants.size(), ',');
  for (const Baseline& baseline : summary.baselines) {
    text += field(baseline.name) + ",," + number(baseline.fitness) + blanks.substr(1) + "\n";
  }
  return text;
}

std::string runs_csv(const ComparisonSummary& summary, const std::vector<ComparedRun>& runs) {
  std::string text = "variant,seed,evaluations,best,evaluations_to_target\n";
  for (const ComparedRun& run : runs) {
    const auto reached = summary.target
                             ? evaluations_to(run, *summary.target, summary.higher_is_better)
                             : std::nullopt;
    text += fmt::format("{},{},{},{},{}\n", field(summary.variants[run.variant].name), run.seed,
                        run.evaluations,
                        run.improvements.empty() ? "" : number(run.improvements.back().fitness),
                        reached ? std::to_string(*reached) : "");
  }
  return text;
}

std::string convergence_csv(const ComparisonSummary& summary) {
  std::string text =
      "variant,evaluations,median,median_low_95,median_high_95,quartile_1,quartile_3\n";
  for (const VariantSummary& v : summary.variants) {
    for (const ConvergencePoint& point : v.convergence) {
      if (!point.median) continue;
      text += fmt::format("{},{},{},{},{},{},{}\n", field(v.name), point.evaluations, *point.median,
                          point.median_95.lower, point.median_95.upper, point.quartiles.lower,
                          point.quartiles.upper);
    }
  }
  return text;
}

}  // namespace gapfarm
