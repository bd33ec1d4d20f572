#include "master/report/run_live.h"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

#include "master/report/glossary.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostPoints = 2000;  // of a line: more than a screen can show

Json number_or_null(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}

std::string worker_cell(const char* label, const std::string& text, bool is_number) {
  return fmt::format(R"(<td data-label="{}"{}>{}</td>)", label,
                     is_number ? R"( class="number")" : "", html_escaped(text));
}

std::string worker_rows(const std::vector<RunWorker>& workers) {
  std::string rows;
  for (const RunWorker& w : workers) {
    rows += R"(<tr><th scope="row">)" + html_escaped(w.name) + "</th>" +
            worker_cell("host", w.host, false) + worker_cell("state", w.state, false) +
            worker_cell("jobs in hand", std::to_string(w.jobs), true) +
            worker_cell("finished", number_text(static_cast<double>(w.finished), 9), true) +
            worker_cell("jobs/s", number_text(w.rate_per_s), true) + "</tr>";
  }
  return rows;
}

std::string list_of(const std::vector<std::string>& lines, const char* css_class) {
  std::string html = fmt::format(R"(<ul class="{}">)", css_class);
  for (const std::string& line : lines) html += "<li>" + html_escaped(line) + "</li>";
  return html + "</ul>";
}

}  // namespace

std::string state_line(const RunFarm& farm) {
  std::string text = html_escaped(farm.state);
  for (const auto& [label, value] : farm.facts) {
    text += "; " + html_escaped(label) + " " + html_escaped(value);
  }
  if (!farm.told.empty()) text += ". " + html_escaped(farm.told);
  return R"(<p id="state" class="state" data-live>)" + text + "</p>";
}

std::string operators_section(const RunReport& report) {
  if (report.operators.empty()) return "";
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

std::string genomes_section(const RunReport& report) {
  if (report.genomes.empty()) return "";
  std::string rows;
  for (const RunGenome& g : report.genomes) {
    std::string parents;
    for (const std::uint64_t p : g.parents)
      parents += (parents.empty() ? "" : ", ") + std::to_string(p);
    rows += fmt::format(
        R"(<tr><th scope="row">{}</th><td class="number" data-label="{}">{}</td><td data-label="made by">{}</td><td data-label="of">{}</td><td data-label="again"><code>gapfarm replay {} --genome {}</code></td></tr>)",
        g.birth_id, html_escaped(report.fitness),
        g.fitness ? number_text(*g.fitness, 7) : html_escaped(g.outcome), html_escaped(g.operators),
        parents.empty() ? "–" : parents, html_escaped(report.name), g.birth_id);
  }
  const std::string unit = report.unit.empty() || report.unit == "-" ? "" : ", " + report.unit;
  return R"(<section id="genomes"><h2>The best of the last )" + term("generation", "generation") +
         R"(</h2><div id="genome-table" data-live><table class="cards" data-file="genomes"><caption class="unseen">The best genomes</caption><thead><tr><th scope="col">genome</th><th scope="col" class="number">)" +
         html_escaped(report.fitness + unit) +
         R"(</th><th scope="col">made by</th><th scope="col">of</th><th scope="col">evaluate it again, to the bit</th></tr></thead><tbody>)" +
         rows + "</tbody></table></div></section>\n";
}

std::string farm_section(const RunFarm& farm) {
  std::string html = R"(<section id="farm"><h2>Farm</h2><div id="farm-now" data-live>)";
  html +=
      farm.workers.empty()
          ? std::string("<p>No worker has been heard of by this run's last master.</p>")
          : R"(<table class="cards" data-file="workers"><caption class="unseen">Workers</caption><thead><tr><th scope="col">worker</th><th scope="col">host</th><th scope="col">state</th><th scope="col" class="number">jobs in hand</th><th scope="col" class="number">finished</th><th scope="col" class="number">jobs/s</th></tr></thead><tbody>)" +
                worker_rows(farm.workers) + "</tbody></table>";
  html += R"(<h3>What it coped with</h3><dl class="provenance">)";
  for (const auto& [label, value] : farm.tally) {
    html += "<div><dt>" + html_escaped(label) + "</dt><dd>" + html_escaped(value) + "</dd></div>";
  }
  html += "</dl><h3>What somebody should look at</h3>";
  html += farm.incidents.empty()
              ? std::string("<p>Nothing: no task was given up, and no two answers differed.</p>")
              : list_of(farm.incidents, "cautions");
  html += "<h3>The end of its log</h3>";
  if (farm.log.empty()) {
    html += "<p>It has no log.txt, or an empty one.</p>";
  } else {
    std::string text;
    for (const std::string& line : farm.log) text += html_escaped(line) + "\n";
    html += R"(<div class="snippet log"><pre tabindex="0">)" + text + "</pre></div>";
  }
  return html + "</div></section>\n";
}

Json generations_json(const RunReport& report) {
  Json list = Json::array();
  const auto best = [](const RunGeneration& g) { return g.best.value_or(0); };
  for (const RunGeneration& g : decimated(report.generations, kMostPoints, best)) {
    list.push_back({{"generation", g.generation},
                    {"best", number_or_null(g.best)},
                    {"median", number_or_null(g.median)},
                    {"worst", number_or_null(g.worst)},
                    {"evaluations", g.evaluations},
                    {"wall_s", g.wall_s}});
  }
  return list;
}

Json operators_json(const RunReport& report) {
  return {{"names", report.operators},
          {"generations", report.probability_generations},
          {"probabilities", report.probabilities}};
}

Json densities_json(const RunReport& report) {
  Json list = Json::array();
  for (const GeneDensity& d : report.densities) {
    list.push_back({{"key", d.key},
                    {"unit", d.unit},
                    {"edges", d.edges},
                    {"generations", d.generations},
                    {"counts", d.counts},
                    {"best", d.best}});
  }
  return list;
}

}  // namespace gapfarm
