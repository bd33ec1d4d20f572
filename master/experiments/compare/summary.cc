#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "common/base/ranges.h"
#include "common/base/text_table.h"
#include "common/trials/text/csv.h"
#include "master/experiments/compare/compare.h"
#include "master/report/figures/figures.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"

namespace gapfarm {
namespace {

constexpr double kCoverage = 0.95;
constexpr int kGridPoints = 80;
// Stands for "no score yet" in sorts: behind every fitness, and finite for the rank tests.
constexpr double kNothing = 1e300;

// 1, 2, ... and then geometric steps up to the last, with multiples of ten where they fall close.
std::vector<std::uint64_t> grid_of(std::uint64_t last) {
  std::vector<std::uint64_t> grid;
  for (int i = 0; i <= kGridPoints; ++i) {
    const double share = static_cast<double>(i) / kGridPoints;
    const auto point =
        static_cast<std::uint64_t>(std::lround(std::pow(static_cast<double>(last), share)));
    if (grid.empty() || point > grid.back()) grid.push_back(point);
  }
  return grid;
}

double cost_after(const ComparedRun& run, std::uint64_t evaluations, bool higher_is_better) {
  const auto after =
      std::ranges::upper_bound(run.improvements, evaluations, {}, &Improvement::evaluations);
  if (after == run.improvements.begin()) return kNothing;
  const double fitness = std::prev(after)->fitness;
  return higher_is_better ? -fitness : fitness;
}

Interval flipped(Interval costs, bool higher_is_better) {
  return higher_is_better ? Interval{-costs.upper, -costs.lower} : costs;
}

ConvergencePoint point_of(const std::vector<double>& costs, std::uint64_t evaluations,
                          bool higher) {
  ConvergencePoint point;
  point.evaluations = evaluations;
  if (quantile(costs, 0.75) >= kNothing / 2) return point;
  const double middle = median(costs);
  point.median = higher ? -middle : middle;
  point.median_95 = flipped(median_interval(costs, kCoverage), higher);
  point.quartiles = flipped({quantile(costs, 0.25), quantile(costs, 0.75)}, higher);
  return point;
}

// Evaluations at which a run first was at least as good as `target`.
std::optional<std::uint64_t> evaluations_to(const ComparedRun& run, double target,
                                            bool higher_is_better) {
  for (const Improvement& improvement : run.improvements) {
    if (higher_is_better ? improvement.fitness >= target : improvement.fitness <= target) {
      return improvement.evaluations;
    }
  }
  return std::nullopt;
}

void add_target(const std::vector<const ComparedRun*>& runs, double target, bool higher,
                VariantSummary* to) {
  std::vector<double> needed;
  double spent = 0;
  for (const ComparedRun* run : runs) {
    const auto reached = evaluations_to(*run, target, higher);
    if (reached) needed.push_back(static_cast<double>(*reached));
    spent += static_cast<double>(reached.value_or(run->evaluations));
  }
  to->successes = needed.size();
  to->success_95 = wilson_interval(needed.size(), runs.size(), kCoverage);
  if (needed.empty()) return;
  to->median_to_target = median(needed);
  to->expected_to_target = spent / static_cast<double>(needed.size());
}

// Final costs as blocks: [seed][variant].
void add_ranks(const std::vector<std::vector<double>>& blocks, ComparisonSummary* to) {
  const std::size_t count = to->variants.size();
  to->pair_p.assign(count, std::vector<double>(count, 1));
  for (const std::vector<double>& block : blocks) {
    const std::vector<double> ranks = mean_ranks(block);
    for (std::size_t v = 0; v < count; ++v) {
      to->variants[v].mean_rank += ranks[v] / static_cast<double>(blocks.size());
    }
  }
  if (count < 2) return;
  to->all = friedman(blocks);
  const auto column = [&](std::size_t v) {
    return mapped(blocks, [&](const std::vector<double>& block) { return block[v]; });
  };
  std::vector<double> p;
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = a + 1; b < count; ++b) p.push_back(mann_whitney(column(a), column(b)).p);
  }
  const std::vector<double> adjusted = holm(p);
  auto next = adjusted.begin();
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = a + 1; b < count; ++b) to->pair_p[a][b] = to->pair_p[b][a] = *next++;
  }
}

LineChart convergence_chart(const ComparisonSummary& summary) {
  LineChart chart;
  chart.title = "Best so far: median over seeds, band between the quartiles";
  chart.x_title = "evaluations";
  chart.y_title =
      summary.fitness + (summary.higher_is_better ? ", higher is better" : ", lower is better");
  chart.log_x = true;
  bool positive = !summary.higher_is_better;
  std::vector<double> starts;
  for (const VariantSummary& v : summary.variants) {
    ChartSeries series;
    series.name = v.name;
    for (const ConvergencePoint& point : v.convergence) {
      if (!point.median) continue;
      const auto x = static_cast<double>(point.evaluations);
      series.line.push_back({x, *point.median});
      series.lower.push_back({x, point.quartiles.lower});
      series.upper.push_back({x, point.quartiles.upper});
      positive = positive && point.quartiles.lower > 0;
    }
    chart.series.push_back(std::move(series));
  }
  // A cost that nears zero is distinguished on a log scale only.
  chart.log_y = positive;
  for (const Baseline& baseline : summary.baselines) {
    if (baseline.fitness) chart.levels.push_back({baseline.name, *baseline.fitness});
  }
  if (summary.target) chart.levels.push_back({"target", *summary.target});
  return chart;
}

std::string short_text(double value) { return fmt::format("{:.4g}", value); }

TextTable results_of(const ComparisonSummary& summary) {
  TextTable table{{summary.fitness, "median", "95 % of the median", "mean rank"}};
  if (summary.target)
    append(table.head, TextTable::Row{"success", "median to target", "expected to target"});
  const auto whole = [](const std::optional<double>& value) {
    return value ? fmt::format("{:.0f}", *value) : std::string("-");
  };
  for (const VariantSummary& v : summary.variants) {
    const auto [lower, upper] = v.median_95;
    const std::string range =
        std::isnan(lower) ? "-" : short_text(lower) + " to " + short_text(upper);
    table.rows.push_back({v.name, short_text(v.median), range, fmt::format("{:.2f}", v.mean_rank)});
    if (!summary.target) continue;
    append(table.rows.back(),
           TextTable::Row{fmt::format("{}/{}", v.successes, summary.seeds),
                          whole(v.median_to_target), whole(v.expected_to_target)});
  }
  for (const Baseline& baseline : summary.baselines) {
    table.rows.push_back({baseline.name, baseline.fitness ? short_text(*baseline.fitness) : "-"});
  }
  return table;
}

void add_results(const ComparisonSummary& summary, PlainPage& page) {
  TextTable table = results_of(summary);
  if (summary.target) table.head.push_back("95 % of the success");
  for (std::size_t v = 0; summary.target && v < summary.variants.size(); ++v) {
    const auto [lower, upper] = summary.variants[v].success_95;
    table.rows[v].push_back(percent_text(lower) + " to " + percent_text(upper));
  }
  for (TextTable::Row& row : table.rows) row.resize(table.head.size());
  page.table(table);
}

void add_ranks(const ComparisonSummary& summary, PlainPage& page) {
  if (summary.variants.size() < 2) return;
  page.heading("Which differences are more than luck");
  page.paragraph(
      fmt::format("Friedman's test over seeds asks whether all variants are alike: chi-square {}, "
                  "p = {}. The table holds Mann-Whitney p-values of the final fitness of two "
                  "variants, adjusted by Holm for the number of pairs.",
                  number_text(summary.all.statistic), p_text(summary.all.p)));
  TextTable table{{""}};
  for (std::size_t a = 0; a < summary.variants.size(); ++a) {
    table.head.push_back(summary.variants[a].name);
    table.rows.push_back({summary.variants[a].name});
    for (std::size_t b = 0; b < summary.variants.size(); ++b) {
      table.rows.back().push_back(a == b ? "" : p_text(summary.pair_p[a][b]));
    }
  }
  page.table(table);
}

std::string number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : ""; }
std::string number(const std::optional<double>& value) { return value ? number(*value) : ""; }

}  // namespace

ComparisonSummary summarise_comparison(std::span<const Variant> variants,
                                       const std::vector<ComparedRun>& runs,
                                       const CompareOptions& options,
                                       std::optional<double> target) {
  const FitnessKind kind = variants.front().config.problem.fitness.kind;
  ComparisonSummary summary;
  summary.fitness = fitness_name(kind);
  summary.higher_is_better = higher_is_better(kind);
  summary.target = target;
  summary.evaluations = options.evaluations;
  summary.seeds = options.seeds;
  const bool higher = summary.higher_is_better;
  std::vector<std::vector<double>> blocks(options.seeds);
  for (std::size_t v = 0; v < variants.size(); ++v) {
    std::vector<const ComparedRun*> own;
    for (const ComparedRun& run : runs) {
      if (run.variant == v) own.push_back(&run);
    }
    assert(own.size() == options.seeds);
    const auto costs_after = [&](std::uint64_t evaluations) {
      return mapped(own,
                    [&](const ComparedRun* run) { return cost_after(*run, evaluations, higher); });
    };
    VariantSummary of;
    of.name = variants[v].name;
    for (const std::uint64_t evaluations : grid_of(options.evaluations)) {
      of.convergence.push_back(point_of(costs_after(evaluations), evaluations, higher));
    }
    const std::vector<double> last = costs_after(options.evaluations);
    for (std::size_t s = 0; s < last.size(); ++s) {
      blocks[s].push_back(last[s]);
      of.final_fitness.push_back(last[s] >= kNothing ? NAN : higher ? -last[s] : last[s]);
    }
    const ConvergencePoint end = of.convergence.back();
    of.median = end.median.value_or(NAN);
    of.median_95 = end.median_95;
    if (target) add_target(own, *target, higher, &of);
    summary.variants.push_back(std::move(of));
  }
  add_ranks(blocks, &summary);
  return summary;
}

std::string comparison_page(const ComparisonSummary& summary, const std::string& title,
                            const std::vector<std::pair<std::string, std::string>>& provenance) {
  PlainPage page(title);
  page.paragraph(
      fmt::format("{} variants, {} seeds each, {} evaluations a run. Fitness: {}, {} is better.",
                  summary.variants.size(), summary.seeds, summary.evaluations, summary.fitness,
                  summary.higher_is_better ? "higher" : "lower"));
  const LineChart chart = convergence_chart(summary);
  page.picture(line_chart(chart), chart.title);
  page.heading(fmt::format("After {} evaluations", summary.evaluations));
  add_results(summary, page);
  if (summary.target) {
    page.paragraph(
        fmt::format("Target: {}. Expected to target: evaluations that all runs spent until they "
                    "reached it or ended, divided by the number of runs that reached it.",
                    number_text(*summary.target, 4)));
  }
  add_ranks(summary, page);
  page.heading("Inputs");
  page.table({{"", ""}, mapped(provenance, [](const auto& row) -> TextTable::Row {
                return {row.first, row.second};
              })});
  return page.finish();
}

std::string comparison_text(const ComparisonSummary& summary) {
  std::string text = results_of(summary).text("<>");
  if (summary.variants.size() > 1) {
    text += fmt::format("all alike? Friedman over seeds: chi-square {:.3g}, p = {:.2g}\n",
                        summary.all.statistic, summary.all.p);
  }
  return text;
}

std::string summary_csv(const ComparisonSummary& summary) {
  std::string text =
      "variant,runs,median,median_low_95,median_high_95,mean_rank,successes,success_low_95,success_"
      "high_95,median_evaluations_to_target,expected_evaluations_to_target";
  for (const VariantSummary& v : summary.variants) text += "," + csv_field("p_holm " + v.name);
  text += "\n";
  for (std::size_t i = 0; i < summary.variants.size(); ++i) {
    const VariantSummary& v = summary.variants[i];
    text += fmt::format("{},{},{},{},{},{},", csv_field(v.name), summary.seeds, number(v.median),
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
  const std::string blanks(8 + summary.variants.size(), ',');
  for (const Baseline& baseline : summary.baselines) {
    text += csv_field(baseline.name) + ",," + number(baseline.fitness) + blanks + "\n";
  }
  return text;
}

std::string runs_csv(const ComparisonSummary& summary, const std::vector<ComparedRun>& runs) {
  std::string text = "variant,seed,evaluations,best,evaluations_to_target\n";
  for (const ComparedRun& run : runs) {
    const auto reached = summary.target
                             ? evaluations_to(run, *summary.target, summary.higher_is_better)
                             : std::nullopt;
    text += fmt::format("{},{},{},{},{}\n", csv_field(summary.variants[run.variant].name), run.seed,
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
      text +=
          fmt::format("{},{},{},{},{},{},{}\n", csv_field(v.name), point.evaluations, *point.median,
                      number(point.median_95.lower), number(point.median_95.upper),
                      point.quartiles.lower, point.quartiles.upper);
    }
  }
  return text;
}

}  // namespace gapfarm
