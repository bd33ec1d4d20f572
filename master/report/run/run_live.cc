#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "common/json/fields.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"
#include "master/report/run/run_report.h"

namespace gapfarm {
namespace {

constexpr std::size_t kMostPoints = 2000;  // of a line: more than a screen can show

std::string log_html(const std::vector<std::string>& lines) {
  if (lines.empty()) return "<p>It has no log.txt, or an empty one.</p>";
  return R"(<div class="snippet log"><pre tabindex="0">)" + html_escaped(joined(lines, "\n")) +
         "\n</pre></div>";
}

constexpr const char* kLittleIsKnown =
    "<p>Nothing that this store reports: an older program wrote it, and the oldest kept no account "
    "of such things.</p>";

// Zeros of a store that has no place for other numbers are none.
bool is_little_known(const RunFarm& farm) {
  return farm.timeline.counts.empty() &&
         std::ranges::all_of(farm.tally, [](const auto& entry) { return entry.second == "0"; });
}

std::string tally_html(const RunFarm& farm) {
  if (is_little_known(farm)) return kLittleIsKnown;
  return html_definitions(farm.tally);
}

// The plots are kept outside of what is put in its place: they draw themselves again.
std::string timeline_html(const RunTimeline& timeline) {
  std::string html = "<h3>Who was there</h3>";
  if (timeline.counts.empty()) {
    return html + "<p>The store shows nothing of it: it was written by an older program.</p>";
  }
  return html + R"(<div id="timeline-plot"></div>)" + kNoScript;
}

}  // namespace

std::string worker_table(const std::vector<RunWorker>& workers, const std::string& none) {
  if (workers.empty()) return "<p>" + none + "</p>";
  std::vector<HtmlColumn> columns = {
      {"worker"},          {"host"}, {"state"}, {"jobs in hand", "number"}, {"finished", "number"},
      {"jobs/s", "number"}};
  const bool failed = !std::ranges::all_of(workers, &std::string::empty, &RunWorker::failure);
  if (failed) columns.push_back({"last failure"});
  const std::vector<HtmlRow> rows = mapped(workers, [&](const RunWorker& w) {
    HtmlRow row{html_escaped(w.name),
                {html_escaped(w.host), html_escaped(w.state), std::to_string(w.jobs),
                 number_text(static_cast<double>(w.finished), 9), number_text(w.rate_per_s)}};
    if (failed) row.cells.push_back(w.failure.empty() ? "–" : html_escaped(w.failure));
    return row;
  });
  return html_table("cards", "workers", "Workers", columns, rows);
}

Json rounded(Json json, int digits) {
  if (json.is_number_float()) return rounded_to_digits(json.get<double>(), digits);
  if (!json.is_structured()) return json;
  for (Json& item : json) item = rounded(std::move(item), digits);
  return json;
}

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
  const std::string operators = term("operator", "operators");
  return html_section(
      "operators", "How often each operator is drawn",
      report.operators.empty()
          ? "<p>Nothing to show: this run's optimiser has no " + operators +
                ", which only the genetic algorithm draws.</p>"
          : "<p>The " + operators +
                R"( that made better offspring are drawn more often: the probabilities by generation.</p>)"
                R"(<ul class="key" id="operator-key" aria-label="Key"></ul><div id="operator-plot"></div>)" +
                kNoScript);
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
  std::vector<HtmlRow> rows;
  for (const auto& [generation, one] : genomes) {
    const std::string parents =
        joined(one.parents, ", ", [](std::uint64_t parent) { return std::to_string(parent); });
    rows.push_back({std::to_string(one.birth_id),
                    {std::to_string(generation),
                     one.fitness ? number_text(*one.fitness, 7) : html_escaped(one.outcome),
                     html_escaped(one.operators), parents.empty() ? "–" : parents,
                     replay_cell(report.name, one.birth_id, where)}});
  }
  return html_table("cards", where, caption,
                    {{"genome"},
                     {"generation", "number"},
                     {html_escaped(with_unit(report.fitness, report.unit, ", ")), "number",
                      html_escaped(report.fitness)},
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
      report.looked_up ? fmt::format(R"( value="{}")", report.looked_up->individual.birth_id) : "");
}

std::string looked_up_html(const RunReport& report) {
  if (!report.without_looked_up.empty()) {
    return "<p>" + html_escaped(report.without_looked_up) + "</p>";
  }
  if (!report.looked_up) return "";
  std::string html = fmt::format("<h3>Genome {}</h3>", report.looked_up->individual.birth_id) +
                     genome_table(report, {*report.looked_up}, "genome", "The genome asked for") +
                     R"(<dl class="provenance">)";
  for (const auto& [key, value] : report.looked_up_values) {
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
  const auto best = [](const RunGeneration& g) { return g.best.value_or(0); };
  return rounded(FieldWriter::list(
      decimated(report.generations, kMostPoints, best),
      [](auto& v, auto& row) { FIELDS(generation, best, median, worst, evaluations, wall_s); }));
}

Json operators_json(const RunReport& report) {
  return rounded({{"names", report.operators},
                  {"generations", report.probability_generations},
                  {"probabilities", report.probabilities}});
}

Json elite_json(const RunReport& report) {
  constexpr auto kAxis = [](auto& v, auto& row) { FIELDS(key, unit, lower, upper); };
  constexpr auto kLine = [](auto& v, auto& row) { FIELDS(birth_id, fitness, shares, values); };
  return rounded({{"axes", FieldWriter::list(report.elite.axes, kAxis)},
                  {"lines", FieldWriter::list(report.elite.lines, kLine)}});
}

Json densities_json(const RunReport& report) {
  return rounded(FieldWriter::list(report.densities, [](auto& v, auto& row) {
    FIELDS(key, unit, edges, generations, counts, best);
  }));
}

std::string farm_section(const RunFarm& farm) {
  if (farm.state.empty()) return "";
  std::string html =
      R"(<div id="farm-now" data-live>)" +
      worker_table(farm.workers, "No worker has been heard of by this run's last master.") +
      "</div>" + timeline_html(farm.timeline) +
      R"(<div id="farm-past" data-live><h3>Workers that failed</h3>)";
  html += farm.failures.empty() ? std::string("<p>None that this store reports.</p>")
                                : html_list(farm.failures, "cautions");
  html += "<h3>What it coped with</h3>" + tally_html(farm);
  html += "<h3>What somebody should look at</h3>";
  html += !farm.incidents.empty() ? html_list(farm.incidents, "cautions")
          : is_little_known(farm)
              ? std::string(kLittleIsKnown)
              : std::string("<p>Nothing: no task was given up, and no two answers differed.</p>");
  return html_section("farm", "Farm",
                      html + "<h3>The end of its log</h3>" + log_html(farm.log) + "</div>");
}

Json timeline_json(const RunFarm& farm) {
  constexpr auto kCount = [](auto& v, auto& row) { FIELDS(unix_s, workers); };
  constexpr auto kMark = [](auto& v, auto& row) { FIELDS(unix_s, workers, kind, text); };
  constexpr auto kSpan = [](auto& v, auto& row) {
    FIELDS(name, host, from_unix_s, to_unix_s, end);
  };
  return {{"counts", FieldWriter::list(farm.timeline.counts, kCount)},
          {"marks", FieldWriter::list(farm.timeline.marks, kMark)},
          {"spans", FieldWriter::list(farm.timeline.spans, kSpan)},
          {"end", farm.timeline.end_unix_s}};
}

}  // namespace gapfarm
