#include "master/report/run/run_live.h"

#include <spdlog/fmt/fmt.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "master/report/glossary.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostPoints = 2000;  // of a line: more than a screen can show

// What a plot can show: more digits would only be sent.
double significant(double value) {
  return std::strtod(fmt::format("{:.7g}", value).c_str(), nullptr);
}

Json significant_all(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double v : values) list.push_back(significant(v));
  return list;
}

Json significant_or_null(const std::optional<double>& value) {
  return value ? Json(significant(*value)) : Json(nullptr);
}

}  // namespace

std::string state_line(const RunFarm& farm) {
  std::string text = html_escaped(farm.state);
  for (const auto& [label, value] : farm.facts) {
    text += "; " + html_escaped(label) + " " + html_escaped(value);
  }
  if (!farm.message.empty()) text += ". " + html_escaped(farm.message);
  return R"(<p id="state" class="state" data-live>)" + text + "</p>";
}

std::string operators_section(const RunReport& report) {
  if (report.operators.empty() && report.generations.empty()) return "";
  if (report.operators.empty()) {
    return R"(<section id="operators"><h2>How often each operator is drawn</h2><p>Nothing to show: this run's optimiser has no )" +
           term("operator", "operators") +
           ", which only the genetic algorithm draws.</p></section>\n";
  }
  return R"(<section id="operators"><h2>How often each operator is drawn</h2><p>The )" +
         term("operator", "operators") +
         R"( that made better offspring are drawn more often: the probabilities by generation.</p>)"
         R"(<ul class="key" id="operator-key" aria-label="Key"></ul><div id="operator-plot"></div>)" +
         kNoScript + "</section>\n";
}

std::string densities_section(const RunReport& report) {
  if (report.densities.empty()) return "";
  return R"(<section id="genes"><h2>Where the population was, by )" +
         term("generation", "generation") +
         R"(</h2><p>Each searched parameter, generation by generation: the darker, the more of the population had that value. The line is the best. What lies at an end of its range could not go where it wanted.</p>)"
         R"(<div class="grid" id="gene-plots"></div>)" +
         kNoScript + "</section>\n";
}

std::string elite_section(const RunReport& report) {
  if (report.elite.lines.empty()) return "";
  return R"(<section id="elite"><h2>The best of the last )" + term("generation", "generation") +
         R"(, across all parameters</h2><p>A row a parameter, from the least to the greatest value that was )" +
         term("bound", "searched") +
         R"(; a line an individual, the best drawn boldly. Where lines part, the search has not settled on a value, or other parameters make up for it.</p><div id="elite-plot"></div>)" +
         kNoScript + "</section>\n";
}

namespace {

// With a button that copies it, where there are scripts.
std::string replay_cell(const std::string& run, std::uint64_t birth_id, const char* where) {
  return fmt::format(
      R"(<code id="replay-{1}-{2}">gapfarm replay {0} --genome {2}</code> <button type="button" class="copy" data-of="replay-{1}-{2}" aria-label="Copy the command for genome {2}" hidden>Copy</button>)",
      html_escaped(run), where, birth_id);
}

std::string genome_table(const RunReport& report, const std::vector<RunGenome>& genomes,
                         const char* where, const char* caption) {
  const std::string unit = report.unit.empty() || report.unit == "-" ? "" : ", " + report.unit;
  std::vector<HtmlRow> rows;
  for (const RunGenome& g : genomes) {
    std::string parents;
    for (const std::uint64_t p : g.parents)
      parents += (parents.empty() ? "" : ", ") + std::to_string(p);
    rows.push_back({std::to_string(g.birth_id),
                    {std::to_string(g.generation),
                     g.fitness ? number_text(*g.fitness, 7) : html_escaped(g.outcome),
                     html_escaped(g.operators), parents.empty() ? "–" : parents,
                     replay_cell(report.name, g.birth_id, where)}});
  }
  return html_table("cards", where, caption,
                    {{"genome"},
                     {"generation", "number"},
                     {html_escaped(report.fitness + unit), "number", html_escaped(report.fitness)},
                     {"made by"},
                     {"of"},
                     {"evaluate it again, to the bit", "", "again"}},
                    rows);
}

// Without scripts a server answers it, too.
std::string genome_form(const RunReport& report) {
  if (!report.served) return "";
  return fmt::format(
      R"(<form action="/view#genomes" class="controls" id="genome-form"><input type="hidden" name="of" value="{}"><label>Best of generation <input type="number" name="best_of" min="1" value="{}"></label><label>Any genome by its number <input type="number" name="genome" min="0"{}></label><button>Show</button></form>)",
      html_escaped(report.name), report.genomes_of,
      report.looked_up ? fmt::format(R"( value="{}")", report.looked_up->birth_id) : "");
}

std::string looked_up_html(const RunReport& report) {
  if (!report.without_looked_up.empty()) {
    return "<p>" + html_escaped(report.without_looked_up) + "</p>";
  }
  if (!report.looked_up) return "";
  std::string html = fmt::format("<h3>Genome {}</h3>", report.looked_up->birth_id) +
                     genome_table(report, {*report.looked_up}, "genome", "The genome asked for") +
                     R"(<dl class="provenance">)";
  for (const auto& [key, value] : report.looked_up->values) {
    html += "<div><dt><code>" + html_escaped(key) + "</code></dt><dd>" + html_escaped(value) +
            "</dd></div>";
  }
  return html + "</dl>";
}

}  // namespace

std::string genomes_section(const RunReport& report) {
  if (report.genomes.empty()) return "";
  std::string html = fmt::format(
      R"(<section id="genomes"><h2>Genomes</h2>{}<div id="genome-table" data-live>{}<h3>The best of {} {}</h3>)",
      genome_form(report), looked_up_html(report), term("generation", "generation"),
      report.genomes_of);
  html += genome_table(report, report.genomes, "genomes", "The best genomes");
  if (!report.farm.given_up.empty()) {
    html +=
        "<h3>Given up</h3><p>Their tasks ended worker after worker; what was tried and how it "
        "ended stands below, at the farm.</p>" +
        genome_table(report, report.farm.given_up, "given-up", "Genomes that were given up");
  }
  return html + "</div></section>\n";
}

Json generations_json(const RunReport& report) {
  Json list = Json::array();
  const auto best = [](const RunGeneration& g) { return g.best.value_or(0); };
  for (const RunGeneration& g : decimated(report.generations, kMostPoints, best)) {
    list.push_back({{"generation", g.generation},
                    {"best", significant_or_null(g.best)},
                    {"median", significant_or_null(g.median)},
                    {"worst", significant_or_null(g.worst)},
                    {"evaluations", g.evaluations},
                    {"wall_s", significant(g.wall_s)}});
  }
  return list;
}

Json operators_json(const RunReport& report) {
  Json shares = Json::array();
  for (const std::vector<double>& row : report.probabilities) {
    shares.push_back(significant_all(row));
  }
  return {{"names", report.operators},
          {"generations", report.probability_generations},
          {"probabilities", std::move(shares)}};
}

Json elite_json(const RunReport& report) {
  Json axes = Json::array(), lines = Json::array();
  for (const RunElite::Axis& axis : report.elite.axes) {
    axes.push_back({{"key", axis.key},
                    {"unit", axis.unit == "-" ? "" : axis.unit},
                    {"lower", axis.lower},
                    {"upper", axis.upper}});
  }
  for (const RunElite::Line& line : report.elite.lines) {
    Json shares = Json::array();
    for (const double share : line.shares) shares.push_back(significant(share));
    lines.push_back({{"id", line.birth_id},
                     {"fitness", significant_or_null(line.fitness)},
                     {"shares", std::move(shares)},
                     {"values", line.values}});
  }
  return {{"axes", std::move(axes)}, {"lines", std::move(lines)}};
}

Json densities_json(const RunReport& report) {
  Json list = Json::array();
  for (const GeneDensity& d : report.densities) {
    list.push_back({{"key", d.key},
                    {"unit", d.unit},
                    {"edges", significant_all(d.edges)},
                    {"generations", d.generations},
                    {"counts", d.counts},
                    {"best", significant_all(d.best)}});
  }
  return list;
}

}  // namespace gapfarm
