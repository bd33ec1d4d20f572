#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/json/fields.h"
#include "common/json/json.h"
#include "master/diagnose/result/diagnosis_json.h"
#include "master/report/figures/figures.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"
#include "master/report/report_html.h"
#include "master/report/run/run_report.h"

namespace gapfarm {

namespace {

constexpr std::size_t kMostVolumes = 1000;

// Why there is no best individual; nothing where there is one.
const char* without_best(const RunReport& report) {
  if (report.generations.empty()) return "No generation was completed yet.";
  const auto has_best = [](const RunGeneration& g) { return g.best.has_value(); };
  return std::ranges::any_of(report.generations, has_best) ? ""
                                                           : "No individual has a fitness yet.";
}

std::string front_section(const RunReport& report) {
  if (report.front.members.empty()) return "";
  return fmt::format(
             R"(<section id="front"><h2>What is traded off</h2><p id="front-words" data-live>{} members of the last generation are beaten by no other in all objectives. The best of the run is their knee, where giving up a little of one gains least of another: genome {}. <code>gapfarm replay {} --genome ID --out model.toml</code> takes another.</p>)",
             report.front.members.size(), report.front.members[report.front.knee].birth_id,
             html_escaped(report.name)) +
         plot_grid("front") + "</section>\n";
}

// Importance of the genes, and the fitness over two of them.
std::string understanding_section(const RunReport& report) {
  if (report.sample.evaluated.size() < 2) return "";
  std::string html =
      R"(<section id="understanding"><h2>What the parameters do</h2><p>The share of the variance that each parameter explains alone, among what was evaluated: first-order Sobol indices from given data, on ranks (Plischke, Borgonovo and Smith 2013). They hold where the search was, not over the whole ranges; what parameters do together does not count, and parameters that moved together share what one of them does. Shares of fewer than 40 evaluations are not known.</p><div id="importance-table" data-live>)";
  std::vector<HtmlColumn> columns = {{"parameter"}};
  for (const std::string& output : report.sample.outputs) {
    columns.push_back({html_escaped(output) + ", %", "number", html_escaped(output)});
  }
  std::vector<HtmlRow> rows;
  for (const RunSample::GeneShare& gene : report.sample.genes) {
    HtmlRow& row = rows.emplace_back(HtmlRow{html_escaped(gene.key), {}});
    for (const double share : gene.importance)
      row.cells.push_back(fmt::format("{:.0f}", 100 * share));
    row.cells.resize(report.sample.outputs.size(), "–");
  }
  return html + html_table("parts", "importance", "Importance of the parameters", columns, rows) +
         "</div>" + plot_area("contour") + "</section>\n";
}

Json front_json(const RunReport& report) {
  std::vector<std::pair<std::uint64_t, double>> known;
  for (std::size_t i = 0; i < report.front.hypervolume.size(); ++i) {
    if (const auto& volume = report.front.hypervolume[i]) {
      known.emplace_back(report.generations[i].generation, *volume);
    }
  }
  Json front = to_json(report.front);
  front["hypervolume"] = decimated(known, kMostVolumes, [](const auto& at) { return at.second; });
  return rounded(std::move(front));
}

Json sample_json(const RunReport& report) {
  Json evaluated = Json::array();
  for (const StoredIndividual& one : report.sample.evaluated) {
    evaluated.push_back({one.birth_id, rounded_to_digits(*one.fitness, 6), rounded(one.genome, 3),
                         rounded(mapped(one.objectives, &NamedValue::second), 5)});
  }
  return {{"genes", FieldWriter::list(report.sample.genes,
                                      [](auto& v, auto& row) {
                                        FIELDS(key, unit, lower, upper, log, importance);
                                      })},
          {"evaluated", std::move(evaluated)}};
}

constexpr int kVersion = 1;

constexpr auto kScore = [](auto& v, auto& row) {
  FIELDS(name);
  IF_ANY(score);
};

struct Errors {
  double position_mm = 0, heading_mrad = 0, score = 0;
};

// Root mean squares and the mean log score, over the trials that one of the two has.
Errors errors_of(const std::vector<DiagnosedTrial>& trials, bool after) {
  Errors sum;
  for (const DiagnosedTrial& t : trials) {
    const Eigen::Vector3d& r = after ? t.final_residual : t.tuned_residual;
    sum.position_mm += r.head<2>().squaredNorm();
    sum.heading_mrad += r[2] * r[2];
    sum.score += after ? t.final_score : t.tuned_score;
  }
  const auto n = static_cast<double>(trials.size());
  return {1e3 * std::sqrt(sum.position_mm / n), 1e3 * std::sqrt(sum.heading_mrad / n),
          sum.score / n};
}

std::string tile(const std::string& title, double before, double after, const std::string& unit) {
  return html_tile(title, number_text(before), number_text(after), unit);
}

std::string summary(const RunReport& report) {
  std::string html = fmt::format(
      R"(<section id="summary"><p class="verdict verdict-none">Run {}</p><h1 data-file="run" id="headline" data-live>{}</h1>)",
      html_escaped(report.name), html_escaped(report.headline));
  if (!report.action.empty()) {
    html += R"(<p class="action"><span aria-hidden="true">→</span> )" +
            html_escaped(report.action) + "</p>";
  }
  if (!report.farm.state.empty()) html += state_line(report.farm);
  if (!report.outcome || report.outcome->trials.empty()) {
    if (!report.without_outcome.empty()) {
      html += "<p>" + html_escaped(report.without_outcome) + "</p>";
    }
    return html + "</section>\n";
  }
  const Errors before = errors_of(report.outcome->trials, false);
  const Errors after = errors_of(report.outcome->trials, true);
  html += R"(<dl class="tiles">)" +
          tile("Log score, these trials", before.score, after.score, term("nat", "nats/trial")) +
          tile("Position, " + term("rms", "rms"), before.position_mm, after.position_mm, "mm") +
          tile("Heading, " + term("rms", "rms"), before.heading_mrad, after.heading_mrad, "mrad");
  return html + "</dl></section>\n";
}

std::string score_table(const std::vector<ScoreRow>& rows, const std::string& column,
                        const char* file) {
  const auto lines = mapped(rows, [](const ScoreRow& row) -> HtmlRow {
    return {html_escaped(row.name), {row.score ? number_text(*row.score, 5) : "–"}};
  });
  return html_table("parts", file, file, {{""}, {html_escaped(column), "number", "score"}}, lines);
}

std::string scores(const RunReport& report) {
  if (report.objective) return "";
  std::string html;
  const RunOutcome none;
  const RunOutcome& outcome = report.outcome ? *report.outcome : none;
  if (outcome.validation.empty()) {
    html +=
        "<p>None were: [validation] in the config names files that evolution does not see. What "
        "stands above is of the trials that were evolved on.</p>";
  } else {
    html +=
        score_table(outcome.validation, with_unit(report.fitness, report.unit, ", "), "kept-apart");
  }
  if (!outcome.baselines.empty()) {
    html += "<h3>" + term("baseline", "Without a simulation") + "</h3>" +
            score_table(outcome.baselines, "nats a trial", "baselines");
  }
  return html_section("scores", "On trials " + term("validation", "held out"), html);
}

std::string progress(const RunReport& report) {
  if (const std::string why = without_best(report); !why.empty()) {
    return html_section("progress", "Fitness", "<p>" + why + "</p>");
  }
  return html_section("progress", "Fitness by " + term("generation", "generation"),
                      plot_area("progress"));
}

constexpr ModelNames kModelsOfRun = {"before", "after"};

void add_pose_sections(PageFrame* frame) {
  frame->add(
      "poses", "Poses",
      poses_section(
          "Measured against simulated end poses",
          "One picture a command, seen from where each trial began; turns on the spot by their "
          "headings, a row a condition. An ellipse or a bar should hold nine trials in ten.",
          kModelsOfRun));
  frame->add(
      "residuals", "Residuals",
      R"(<section id="residuals"><h2>)" + term("residual", "Residuals") + "</h2>" +
          residual_plots("Against what may drive them",
                         "Measured minus predicted, along the axes of the predicted end pose.",
                         kModelsOfRun));
}

Json page_json(const RunReport& report) {
  Json page = {{"models", {{"tuned", "before"}, {"final", "after"}}},
               {"without_trials", report.without_outcome},
               {"fitness",
                {{"name", report.fitness},
                 {"unit", report.unit},
                 {"best", report.best_label()},
                 {"higher_is_better", report.higher_is_better}}},
               {"generations", generations_json(report)},
               {"operators", operators_json(report)},
               {"genes", densities_json(report)},
               {"elite", elite_json(report)},
               {"front", front_json(report)},
               {"sample", sample_json(report)},
               {"timeline", timeline_json(report.farm)},
               {"run", report.name},
               {"windows", report.windows},
               {"logged_trials", report.trials},
               {"held_out", report.served ? report.held_out : 0},
               {"parameters", parameters_json(report.parameters)},
               {"effects", Json::array()},
               {"where", Json::array()}};
  for (const ParameterRow& row : report.parameters) {
    // Effects that were searched have places, too.
    if (row.effect.empty()) continue;
    const auto name = [](const Json& effect) { return effect["name"].get<std::string>(); };
    if (contains(page["effects"], row.effect, name)) continue;
    page["effects"].push_back({{"name", row.effect}, {"parameters", Json::object()}});
  }
  if (report.pieces) {
    page["pictures"] = {
        {"ends", ""}, {"residuals", ""}, {"x", "x"}, {"y", "y"}, {"shown", Json::array()}};
  }
  return page;
}

}  // namespace

std::string to_json(const RunOutcome& outcome) {
  Diagnosis table;
  table.trials = outcome.trials;
  const Json json = {{"version", kVersion},
                     {"validation", FieldWriter::list(outcome.validation, kScore)},
                     {"baselines", FieldWriter::list(outcome.baselines, kScore)},
                     {"trials", trials_json(table)}};
  return json_text(json);
}

Result<RunOutcome> parse_run_outcome(const std::string& text) {
  const Json json = parse_json(text);
  if (json.is_discarded() || !json.is_object() || json.value("version", 0) != kVersion ||
      !json.contains("trials")) {
    return Error{"the run's outcome cannot be read; was it kept by another program?"};
  }
  RunOutcome outcome;
  std::string error;
  FieldReader root(json, "", &error);
  root.list("validation", outcome.validation, kScore);
  root.list("baselines", outcome.baselines, kScore);
  if (!error.empty()) return Error{"the run's outcome: " + error};
  ASSIGN_OR_RETURN(outcome.trials, parse_trials(json["trials"], {}));
  return outcome;
}

std::string fitness_chart(const RunReport& report) {
  LineChart chart;
  chart.title = "Fitness by generation";
  chart.x_title = "generation";
  chart.y_title = report.fitness + (report.unit == "-" ? "" : " (" + report.unit + ")") +
                  (report.higher_is_better ? ", higher is better" : ", lower is better");
  chart.whole_x = true;
  ChartSeries best{.name = report.best_label() + ", and down to the worst"};
  ChartSeries median{.name = "median"};
  std::vector<double> medians;
  for (const RunGeneration& point : report.generations) {
    if (!point.best || !point.median || !point.worst) continue;
    const auto x = static_cast<double>(point.generation);
    best.line.push_back({x, *point.best});
    best.lower.push_back({x, *point.worst});
    median.line.push_back({x, *point.median});
    medians.push_back(*point.median);
  }
  best.upper = best.line;
  if (!medians.empty()) {
    // Toward the bad side: nine tenths of the medians.
    std::ranges::sort(medians);
    const std::size_t tenth = medians.size() / 10;
    if (report.higher_is_better) {
      chart.y_least = medians[tenth];
    } else {
      chart.y_most = medians[medians.size() - 1 - tenth];
    }
  }
  chart.series = {best, median};
  return line_chart(chart);
}

std::string run_html(const RunReport& report) {
  const bool poses = report.outcome && !report.outcome->trials.empty();
  const bool driven = poses && !report.pieces;
  PageFrame frame;
  frame.title = "gapfarm run " + report.name;
  frame.brand = "run";
  frame.served = report.served;
  frame.body = summary(report);
  frame.add("progress", "Fitness", progress(report));
  frame.body += operators_section(report);
  frame.add("parameters", "Parameters",
            parameters_section(
                report.parameters, {},
                {{"before", "before"}, {"after", "after"}, {"population", "last generation"}},
                without_best(report)));
  frame.add("front", "Front", front_section(report));
  frame.add("genes", "Genes", densities_section(report));
  frame.add("elite", "Elite", elite_section(report));
  frame.add("understanding", "Why", understanding_section(report));
  frame.add("scores", "Held out", scores(report));
  if (driven) {
    frame.add("floor", "Floor", floor_section());
    frame.add("drives", "Drives", drives_section(kModelsOfRun));
  }
  if (poses) add_pose_sections(&frame);
  if (report.served && !report.genomes.empty() && !report.objective) {
    frame.add("watch", "Watch",
              watch_section(report.windows  ? "window"
                            : report.pieces ? "push"
                                            : "drive"));
  }
  frame.add("genomes", "Genomes", genomes_section(report));
  frame.add("farm", "Farm", farm_section(report.farm));
  frame.add("provenance", "Inputs",
            html_section("provenance", "What went in", html_definitions(report.provenance)));
  Diagnosis table;
  if (report.outcome) table.trials = report.outcome->trials;
  return framed_page(frame, page_json(report), trials_json(table, kPlotDigits));
}

}  // namespace gapfarm
