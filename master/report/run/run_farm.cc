// A run's farm on its page: who worked, who came and went, what it coped with.
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "master/report/html.h"
#include "master/report/page_frame.h"
#include "master/report/run/run_live.h"

namespace gapfarm {
namespace {

using Json = nlohmann::ordered_json;

std::string list_of(const std::vector<std::string>& lines, const char* css_class) {
  std::string html = fmt::format(R"(<ul class="{}">)", css_class);
  for (const std::string& line : lines) html += "<li>" + html_escaped(line) + "</li>";
  return html + "</ul>";
}

std::string worker_table(const RunFarm& farm) {
  if (farm.workers.empty()) return "<p>No worker has been heard of by this run's last master.</p>";
  std::vector<HtmlRow> rows;
  for (const RunWorker& w : farm.workers) {
    rows.push_back({html_escaped(w.name),
                    {html_escaped(w.host), html_escaped(w.state), std::to_string(w.jobs),
                     number_text(static_cast<double>(w.finished), 9), number_text(w.rate_per_s),
                     w.failure.empty() ? "–" : html_escaped(w.failure)}});
  }
  return html_table("cards", "workers", "Workers",
                    {{"worker"},
                     {"host"},
                     {"state"},
                     {"jobs in hand", "number"},
                     {"finished", "number"},
                     {"jobs/s", "number"},
                     {"last failure"}},
                    rows);
}

std::string log_html(const std::vector<std::string>& lines) {
  if (lines.empty()) return "<p>It has no log.txt, or an empty one.</p>";
  std::string text;
  for (const std::string& line : lines) text += html_escaped(line) + "\n";
  return R"(<div class="snippet log"><pre tabindex="0">)" + text + "</pre></div>";
}

constexpr const char* kLittleIsKnown =
    "<p>Nothing that this store reports: an older program wrote it, and the oldest kept no "
    "account "
    "of such things.</p>";

// Zeros of a store that has no place for other numbers are none.
bool is_little_known(const RunFarm& farm) {
  return farm.timeline.counts.empty() &&
         std::all_of(farm.tally.begin(), farm.tally.end(),
                     [](const auto& entry) { return entry.second == "0"; });
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

std::string farm_section(const RunFarm& farm) {
  std::string html = R"(<section id="farm"><h2>Farm</h2><div id="farm-now" data-live>)" +
                     worker_table(farm) + "</div>" + timeline_html(farm.timeline) +
                     R"(<div id="farm-past" data-live><h3>Workers that failed</h3>)";
  html += farm.failures.empty() ? std::string("<p>None that this store reports.</p>")
                                : list_of(farm.failures, "cautions");
  html += "<h3>What it coped with</h3>" + tally_html(farm);
  html += "<h3>What somebody should look at</h3>";
  html += !farm.incidents.empty() ? list_of(farm.incidents, "cautions")
          : is_little_known(farm)
              ? std::string(kLittleIsKnown)
              : std::string("<p>Nothing: no task was given up, and no two answers differed.</p>");
  return html + "<h3>The end of its log</h3>" + log_html(farm.log) + "</div></section>\n";
}

Json timeline_json(const RunFarm& farm) {
  const RunTimeline& t = farm.timeline;
  Json counts = Json::array(), marks = Json::array(), spans = Json::array();
  for (const auto& count : t.counts) counts.push_back({count.unix_s, count.workers});
  for (const auto& mark : t.marks) {
    marks.push_back(
        {{"at", mark.unix_s}, {"workers", mark.workers}, {"kind", mark.kind}, {"text", mark.text}});
  }
  for (const auto& span : t.spans) {
    spans.push_back({{"name", span.name},
                     {"host", span.host},
                     {"from", span.from_unix_s},
                     {"to", span.to_unix_s},
                     {"end", span.end}});
  }
  return {{"counts", std::move(counts)},
          {"marks", std::move(marks)},
          {"spans", std::move(spans)},
          {"end", t.end_unix_s}};
}

}  // namespace gapfarm
