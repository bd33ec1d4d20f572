// Of a run's page: the front of several objectives, and what the evaluations say of the genes.
#include <spdlog/fmt/fmt.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"
#include "master/report/run/run_live.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostVolumes = 1000;

// What a plot can show of it.
Json short_list(const std::vector<double>& values, int digits) {
  Json list = Json::array();
  for (const double v : values) {
    list.push_back(std::strtod(fmt::format("{:.{}g}", v, digits).c_str(), nullptr));
  }
  return list;
}

}  // namespace

std::string front_section(const RunReport& report) {
  if (report.front.members.empty()) return "";
  return fmt::format(
             R"(<section id="front"><h2>What is traded off</h2><p id="front-words" data-live>{} members of the last generation are beaten by no other in all objectives. The best of the run is their knee, where giving up a little of one gains least of another: genome {}. <code>gapfarm replay {} --genome ID --out model.toml</code> takes another.</p>)",
             report.front.members.size(), report.front.members[report.front.knee].birth_id,
             html_escaped(report.name)) +
         R"(<div class="controls" id="front-controls"></div><div class="grid" id="front-plots"></div>)" +
         kNoScript + "</section>\n";
}

std::string understanding_section(const RunReport& report) {
  if (report.sample.evaluated.size() < 2) return "";
  std::string html =
      R"(<section id="understanding"><h2>What the parameters do</h2><p>The share of the variance that each parameter explains alone, among what was evaluated: first-order Sobol indices from given data, on ranks (Plischke, Borgonovo and Smith 2013). They hold where the search was, not over the whole ranges; what parameters do together does not count, and parameters that moved together share what one of them does. 0 of fewer than 40 evaluations.</p><div id="importance-table" data-live>)";
  std::vector<HtmlColumn> columns = {{"parameter"}};
  for (const std::string& output : report.sample.outputs) {
    columns.push_back({html_escaped(output) + ", %", "number", html_escaped(output)});
  }
  std::vector<HtmlRow> rows;
  for (const RunSample::GeneShare& gene : report.sample.genes) {
    HtmlRow& row = rows.emplace_back(HtmlRow{html_escaped(gene.key), {}});
    for (const double share : gene.importance)
      row.cells.push_back(fmt::format("{:.0f}", 100 * share));
  }
  return html + html_table("parts", "importance", "Importance of the parameters", columns, rows) +
         R"(</div><div class="controls" id="contour-controls"></div><div id="contour-plot"></div>)" +
         kNoScript + "</section>\n";
}

Json front_json(const RunReport& report) {
  const RunFront& front = report.front;
  Json objectives = Json::array(), members = Json::array(), volumes = Json::array();
  for (const auto& [name, maximise] : front.objectives) {
    objectives.push_back({{"name", name}, {"maximise", maximise}});
  }
  for (const StoredIndividual& member : front.members) {
    const auto values = mapped(member.objectives, &NamedValue::second);
    members.push_back({{"id", member.birth_id}, {"values", short_list(values, 7)}});
  }
  std::vector<std::pair<std::uint64_t, double>> known;
  for (std::size_t i = 0; i < front.hypervolume.size(); ++i) {
    if (front.hypervolume[i]) {
      known.emplace_back(report.generations[i].generation, *front.hypervolume[i]);
    }
  }
  for (const auto& [generation, volume] :
       decimated(known, kMostVolumes, [](const auto& at) { return at.second; })) {
    volumes.push_back({generation, short_list({volume}, 7)[0]});
  }
  return {{"objectives", std::move(objectives)},
          {"members", std::move(members)},
          {"knee", front.knee},
          {"reference", short_list(front.reference, 7)},
          {"hypervolume", std::move(volumes)}};
}

Json sample_json(const RunReport& report) {
  Json genes = Json::array(), evaluated = Json::array();
  for (const RunSample::GeneShare& gene : report.sample.genes) {
    genes.push_back({{"key", gene.key},
                     {"unit", gene.unit == "-" ? "" : gene.unit},
                     {"lower", gene.lower},
                     {"upper", gene.upper},
                     {"log", gene.log},
                     {"importance", short_list(gene.importance, 3)}});
  }
  for (const RunSample::Evaluated& one : report.sample.evaluated) {
    evaluated.push_back({one.birth_id, short_list({one.fitness}, 6)[0], short_list(one.shares, 3),
                         short_list(one.objectives, 5)});
  }
  return {{"genes", std::move(genes)}, {"evaluated", std::move(evaluated)}};
}

}  // namespace gapfarm
