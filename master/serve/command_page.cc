// A command at work: its stages, what it has found, its workers.

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"
#include "master/serve/site.h"
#include "master/store/answer_store.h"

namespace gapfarm {
namespace {

std::string command_tiles(const CommandRecord& r) {
  const auto tile_of = [](const char* title, const std::string& value, const std::string& small) {
    return html_tile(title, "", value, "", "<small>" + small + "</small>");
  };
  const bool running = r.running();
  const bool simulates = r.simulated + r.remembered > 0;
  std::string html = R"(<dl class="tiles" id="tiles" data-live>)";
  html += tile_of("Done", percent_text(r.share), bar_svg(r.share, "fill-named"));
  html +=
      tile_of("Stage", fmt::format("{} of {}", r.number, r.stages),
              html_escaped(r.stage) + (r.total > 0 ? fmt::format(": {} of {}{}", r.done, r.total,
                                                                 simulates ? " simulations" : "")
                                                   : ""));
  html += tile_of(
      running ? "Time left" : "Took",
      running ? (r.time_left_s ? "about " + format_duration(*r.time_left_s) : "not known yet")
              : format_duration(r.heartbeat_unix_s - r.began_unix_s),
      simulates ? fmt::format("{} simulated, {} at hand{}", r.simulated, r.remembered,
                              rate_text(r.rate_per_s))
                : "nothing is simulated so far");
  return html + "</dl>";
}

// Words that need it lead to their explanation.
std::string with_terms(const std::string& text) {
  std::string html = html_escaped(text);
  for (const auto& [id, label] : {std::pair{"nat", "nats a trial"},
                                  {"rms", "root mean square"},
                                  {"gain", "gain, nats"},
                                  {"gap", "gap, nats"},
                                  {"held-out", "trials that a fit did not see"}}) {
    const std::string found = label;
    if (const auto at = html.find(found); at != html.npos) {
      html.replace(at, found.size(), term(id, found));
    }
  }
  return html;
}

std::string finding_html(const Finding& found) {
  std::string html =
      "<h4>" + html_escaped(found.about) + "</h4><p>" + with_terms(found.text) + "</p>";
  if (found.rows.empty()) return html;
  std::vector<HtmlRow> rows;
  for (const auto& [name, value] : found.rows) {
    rows.push_back({html_escaped(name), {html_escaped(value)}});
  }
  return html + html_table("parts", found.about, found.about,
                           {{html_escaped(found.columns.first)},
                            {with_terms(found.columns.second), "number"}},
                           rows);
}

// Whether stage `k` of the plan is over, in work or to come, and how long it took.
std::string stage_text(const CommandRecord& r, std::size_t k) {
  const double began_s = r.plan[k].began_unix_s;
  const bool last = k + 1 >= r.number;
  if (k + 1 > r.number) return r.running() ? "to come" : "not reached";
  if (began_s == 0) return "not needed";
  double ended_s = r.heartbeat_unix_s;
  for (std::size_t j = k + 1; j < r.plan.size() && !last; ++j) {
    if (r.plan[j].began_unix_s == 0) continue;
    ended_s = r.plan[j].began_unix_s;
    break;
  }
  const std::string took = format_duration(std::max(0.0, ended_s - began_s));
  if (!last || r.state == RunState::kFinished) return "done in " + took;
  return r.running() ? "at work, for " + took : run_state_name(r.state) + (" after " + took);
}

// The stages in their order, each with what was found in it.
std::string findings_list(const CommandRecord& r) {
  std::string html = R"(<ol class="stages">)";
  for (std::size_t k = 0; k < r.plan.size(); ++k) {
    const bool now = r.running() && k + 1 == r.number;
    html +=
        fmt::format(R"(<li{}><h3>{} <small>{}</small></h3>)", now ? R"( aria-current="step")" : "",
                    html_escaped(r.plan[k].name), stage_text(r, k));
    bool any = false;
    for (const auto& [stage, found] : r.findings) {
      if (stage != r.plan[k].name) continue;
      html += finding_html(found);
      any = true;
    }
    if (now && !any) html += "<p>Nothing so far.</p>";
    html += "</li>";
  }
  return html + "</ol>";
}

std::string found_section(const CommandRecord& r) {
  return R"(<section id="found"><h2>What has been found so far</h2><p>Stage by stage. None of it is final: the report, which takes this page's place at the end, may say something else.</p><div id="found-list" data-live>)" +
         findings_list(r) + "</div></section>\n";
}

std::string stages_section(const CommandRecord& r, const std::vector<AnsweredStage>& stages) {
  std::vector<HtmlRow> rows;
  for (const AnsweredStage& stage : stages) {
    const bool now = r.running() && stage.name == r.stage;
    rows.push_back({html_escaped(stage.name),
                    {number_text(static_cast<double>(stage.answers), 9),
                     now ? R"(<span class="tag">now</span>)" : ""}});
  }
  return R"(<section id="stages"><h2>What has been simulated</h2><p>By stage, in the order in which they began. What is kept is not simulated again.</p><div id="stage-table" data-live>)" +
         (rows.empty() ? "<p>Nothing so far.</p>"
                       : html_table("cards", "stages", "Stages",
                                    {{"stage"}, {"simulations kept", "number"}, {}}, rows)) +
         "</div></section>\n";
}

std::string workers_section(const CommandRecord& r) {
  const auto workers = mapped(r.workers, [](const WorkerStatus& w) { return RunWorker{w, ""}; });
  return R"(<section id="workers"><h2>Workers</h2><div id="worker-table" data-live>)" +
         worker_table(workers, r.running() ? "No worker has been heard of."
                                           : "The command has ended, and with it its workers.") +
         "</div></section>\n";
}

}  // namespace

std::string trouble_page(const std::string& what, const std::string& why) {
  PageFrame frame;
  frame.served = true;
  frame.title = "gapfarm: " + what + " cannot be shown";
  frame.brand = "cannot be shown";
  frame.places = {{"trouble", "Why"}};
  frame.body =
      R"(<section id="trouble"><h1 data-file="trouble">)" + html_escaped(what) +
      R"( cannot be shown</h1><p class="caution-box" id="why" data-live>)" + html_escaped(why) +
      R"(</p><p>Nothing was changed. This page takes its place as soon as it can be read; <a href="/">everything else</a> can be seen meanwhile.</p></section>)";
  return framed_page(std::move(frame));
}

Result<std::string> command_page(const FoundWork& found, double now_unix_s) {
  ASSIGN_OR_RETURN(const auto record, command_status(found.path, now_unix_s));
  const CommandRecord r = record.value_or(CommandRecord());
  ASSIGN_OR_RETURN(const auto stages, read_stages(answer_file(found.path)));
  const bool is_diagnosis = r.command == "diagnose";
  PageFrame frame;
  frame.served = true;
  frame.title = r.command + " " + run_state_name(r.state) + ": " + found.name;
  frame.brand = r.command.empty() ? "simulations" : r.command;
  frame.places = {{"summary", "State"}};
  if (is_diagnosis) frame.places.emplace_back("found", "Found so far");
  frame.places.insert(frame.places.end(), {{"stages", "Simulations"}, {"workers", "Workers"}});
  const std::string message =
      r.running() ? (r.waiting.empty() ? r.stage : r.waiting) : r.stop_reason;
  frame.body = fmt::format(
      R"(<section id="summary"><div id="now" data-live><p class="verdict verdict-none">{}</p><h1 data-file="{}">{}</h1><p>{}</p></div>{}</section>)",
      r.state == RunState::kUnknown ? "unknown" : run_state_name(r.state), html_escaped(r.command),
      html_escaped(message.empty() ? found.name : message), html_escaped(r.arguments),
      command_tiles(r));
  if (is_diagnosis) frame.body += found_section(r);
  frame.body += stages_section(r, stages) + workers_section(r);
  return framed_page(std::move(frame));
}

}  // namespace gapfarm
