#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>

#include "common/base/ranges.h"
#include "common/base/text.h"
#include "master/report/html.h"
#include "master/report/page_frame.h"
#include "master/serve/request.h"
#include "master/serve/site.h"

namespace gapfarm {
namespace {

// The best by generation, worst tenth omitted from its scale.
std::string spark(const WorkEntry& entry) {
  const std::vector<double>& values = entry.best_by_generation;
  if (values.size() < 2) return "";
  std::vector<double> sorted = values;
  std::ranges::sort(sorted);
  if (!(sorted.back() > sorted.front())) return "";
  const std::size_t tenth = sorted.size() / 10;
  double low = sorted[entry.higher_is_better ? tenth : 0];
  double to = sorted[sorted.size() - 1 - (entry.higher_is_better ? 0 : tenth)];
  // Of what changed once and stayed there nothing is omitted.
  if (!(to > low)) low = sorted.front(), to = sorted.back();
  const double from = low - 0.1 * (to - low);
  std::string d;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double share = std::clamp((values[i] - from) / (to - from), 0.0, 1.0);
    d += fmt::format("{}{:.0f} {:.1f}", i == 0 ? 'M' : 'L',
                     100.0 * static_cast<double>(i) / static_cast<double>(values.size() - 1),
                     20 - 18 * share);
  }
  return R"(<svg class="spark" viewBox="0 0 100 22" preserveAspectRatio="none" aria-hidden="true"><path d=")" +
         d + R"("/></svg>)";
}

std::size_t in_state(const WorkEntry& e, std::string_view state) {
  return static_cast<std::size_t>(std::ranges::count(e.workers, state, &WorkerStatus::state));
}

std::string state_text(const WorkEntry& e) {
  if (!e.trouble.empty()) {
    return R"(<span class="warning">cannot be read</span><small>)" + html_escaped(e.trouble) +
           "</small>";
  }
  std::string text =
      fmt::format(R"(<strong class="state-{0}">{0}</strong>)", run_state_name(e.state));
  if (e.running()) {
    if (e.kind != FoundWork::Kind::kRun) text += " " + percent_text(e.share);
    if (e.time_left_s) text += ", about " + format_duration(*e.time_left_s) + " left";
    const std::size_t there = e.workers.size() - in_state(e, "gone");
    text += fmt::format(", {} worker{}", there, there == 1 ? "" : "s");
    if (e.rate_per_s > 0) text += ", " + number_text(e.rate_per_s) + "/s";
  }
  if (e.farm.alarms + e.given_up > 0) {
    text += fmt::format(R"( <span class="warning">▲ {} given up, {} alarms</span>)", e.given_up,
                        e.farm.alarms);
  }
  return text + (e.status_text.empty() ? "" : "<small>" + html_escaped(e.status_text) + "</small>");
}

// With what a nat is, where it is one.
std::string unit_html(const std::string& unit) {
  return unit == "nats/trial" ? term("nat", unit) : html_escaped(unit);
}

HtmlRow row_of_entry(const WorkEntry& e) {
  const bool run = e.kind == FoundWork::Kind::kRun && e.trouble.empty();
  const std::string box =
      run ? fmt::format(
                R"(<input type="checkbox" name="of" value="{0}" aria-label="compare {0}"> )",
                html_escaped(e.name))
          : "";
  std::string best;
  if (e.best) {
    best = number_text(*e.best, 6) + (e.unit == "-" ? "" : " " + unit_html(e.unit)) + "<small>" +
           html_escaped(e.fitness) + "</small>";
  }
  std::string extent;
  if (run) {
    extent = fmt::format("generation {}<small>{} evaluations</small>", e.generation,
                         number_text(static_cast<double>(e.evaluations), 9));
  }
  const std::string head =
      fmt::format(R"({}<a href="/view?of={}">{}</a><small>{}</small>)", box,
                  percent_encoded(e.name), html_escaped(e.name), html_escaped(e.what));
  return {head,
          {state_text(e), best, spark(e), extent, run ? std::to_string(e.trials) : "",
           run ? std::to_string(e.seed) : "", "<small>" + html_escaped(e.config) + "</small>",
           e.heartbeat_unix_s > 0 ? utc_text(e.heartbeat_unix_s, "%Y-%m-%d %H:%M UTC") : "–"}};
}

std::string list_address(const ListView& view, const std::string& sort) {
  std::string address = "/?sort=" + sort;
  if (!view.query.empty()) address += "&q=" + percent_encoded(view.query);
  if (!view.state.empty()) address += "&state=" + percent_encoded(view.state);
  return html_escaped(address);
}

// A column whose head sorts by it.
HtmlColumn sorted_column(const char* key, const char* label, const ListView& view,
                         const char* css = "") {
  return {fmt::format(R"(<a href="{}">{}</a>)", list_address(view, key), label), css, label,
          view.sort == key};
}

std::string work_table(const std::vector<WorkEntry>& entries, const ListView& view) {
  return html_table("cards work", "work", "Runs and diagnoses",
                    {sorted_column("name", "name", view),
                     sorted_column("state", "state", view),
                     sorted_column("best", "best", view, "number"),
                     {"by generation"},
                     {"so far"},
                     sorted_column("trials", "trials", view, "number"),
                     sorted_column("seed", "seed", view, "number"),
                     sorted_column("config", "config", view),
                     sorted_column("changed", "last heard of", view)},
                    mapped(entries, row_of_entry));
}

void sort_entries(std::vector<WorkEntry>* entries, const std::string& sort) {
  const auto before = [&](const WorkEntry& a, const WorkEntry& b) {
    if (sort == "name") return a.name < b.name;
    if (sort == "state") {
      return std::string_view(run_state_name(a.state)) > run_state_name(b.state);
    }
    // Of different fitnesses there is no better one.
    if (sort == "best" && a.fitness != b.fitness) return a.fitness > b.fitness;
    if (sort == "best" && a.best && b.best) {
      return a.higher_is_better ? *a.best > *b.best : *a.best < *b.best;
    }
    if (sort == "best") return a.best.has_value() > b.best.has_value();
    if (sort == "trials") return a.trials > b.trials;
    if (sort == "seed") return a.seed < b.seed;
    if (sort == "config") return a.config < b.config;
    return a.heartbeat_unix_s > b.heartbeat_unix_s;
  };
  std::stable_sort(entries->begin(), entries->end(), before);
}

bool is_wanted(const WorkEntry& e, const ListView& view) {
  if (!view.state.empty() && run_state_name(e.state) != view.state) return false;
  const std::string all = lowered(e.name + " " + e.what + " " + e.config + " " + e.status_text +
                                  " seed " + std::to_string(e.seed));
  std::istringstream terms(lowered(view.query));
  for (std::string word; terms >> word;) {
    if (all.find(word) == all.npos) return false;
  }
  return true;
}

// Works without scripts.
std::string filter_form(const ListView& view) {
  std::string options;
  for (const char* state : {"", "running", "finished", "stopped", "failed"}) {
    options += fmt::format(R"(<option value="{}"{}>{}</option>)", state,
                           view.state == state ? " selected" : "", *state == '\0' ? "any" : state);
  }
  return fmt::format(
      R"(<form action="/" class="controls" id="filter" role="search"><label>Filter <input type="search" name="q" value="{}" placeholder="name, config, seed"></label><label>State <select name="state">{}</select></label>{}<button>Filter</button></form>)",
      html_escaped(view.query), options,
      view.sort.empty()
          ? ""
          : R"(<input type="hidden" name="sort" value=")" + html_escaped(view.sort) + R"(">)");
}

std::string comparison_table(std::span<const RunReport> runs) {
  std::vector<const ParameterRow*> keys;
  for (const RunReport& run : runs) {
    for (const ParameterRow& row : run.parameters) {
      if (!contains(keys, row.key, &ParameterRow::key)) keys.push_back(&row);
    }
  }
  std::vector<HtmlColumn> columns = {{"parameter"}};
  for (const RunReport& run : runs) columns.push_back({html_escaped(run.name), "number"});
  std::vector<HtmlRow> rows;
  for (const ParameterRow* key : keys) {
    HtmlRow& line = rows.emplace_back();
    line.head = "<code>" + html_escaped(key->key) + "</code> <small>" +
                html_escaped(key->unit == "-" ? "" : key->unit) + "</small>";
    for (const RunReport& run : runs) {
      const auto row = std::ranges::find(run.parameters, key->key, &ParameterRow::key);
      std::string& value = line.cells.emplace_back("–");
      if (row == run.parameters.end()) continue;
      value = row->choice.empty() ? number_text(row->after, 4) : html_escaped(row->choice);
      if (bound_hit(*row) != BoundHit::kNone)
        value += R"( <small class="worse">▲ )" + term("bound", "at its bound") + "</small>";
    }
  }
  return html_table("cards", "compared", "Parameters side by side", columns, rows);
}

}  // namespace

std::string list_page(std::vector<WorkEntry> entries, const ListView& view,
                      const std::vector<std::string>& folders) {
  const std::size_t all = entries.size();
  const auto running = std::ranges::count(entries, RunState::kRunning, &WorkEntry::state);
  std::erase_if(entries, [&](const WorkEntry& e) { return !is_wanted(e, view); });
  sort_entries(&entries, view.sort);
  PageFrame frame;
  frame.served = true;
  frame.title = fmt::format("gapfarm: {} running", running);
  frame.brand = "runs and diagnoses";
  frame.places = {{"work", "All"}};
  frame.body = fmt::format(
      R"(<section id="work"><h1 id="headline" data-file="gapfarm" data-live>{} here, {} running{}</h1><p>Beneath <code>{}</code>: runs, diagnoses, comparisons and studies, as their stores show. Tick two runs or more to see them beside each other.</p>)",
      all, running, entries.size() == all ? "" : fmt::format("; {} shown", entries.size()),
      html_escaped(joined(folders)));
  if (all == 0) {
    frame.body +=
        "<p>There is nothing yet: <code>gapfarm evolve configs/demo.toml --out run/demo</code> "
        "makes a run. This page shows it by itself.</p>";
  }
  frame.body += filter_form(view) + R"(<form action="/compare"><div id="entries" data-live>)";
  if (!entries.empty()) {
    frame.body += work_table(entries, view);
  } else if (all > 0) {
    frame.body += R"(<p>None of them fits the filter. <a href="/">Show all</a></p>)";
  }
  frame.body += R"(</div><button>Compare the ticked runs</button></form></section>)";
  return framed_page(std::move(frame));
}

std::string compare_page(std::span<const RunReport> runs) {
  PageFrame frame;
  frame.served = true;
  frame.title = fmt::format("gapfarm: {} runs", runs.size());
  frame.brand = "runs beside each other";
  frame.places = {{"compared", "Fitness"}, {"sides", "Parameters"}};
  Json page = no_plots();
  page["fitness"] = {{"name", runs.front().fitness},
                     {"unit", runs.front().unit},
                     {"higher_is_better", runs.front().higher_is_better}};
  page["compared"] = Json::array();
  std::string key, others;
  for (const RunReport& run : runs) {
    page["compared"].push_back({{"name", run.name}, {"generations", generations_json(run)}});
    key += fmt::format(R"(<li><a href="/view?of={}">{}</a>: {}</li>)", percent_encoded(run.name),
                       html_escaped(run.name), html_escaped(run.headline));
    if (run.fitness != runs.front().fitness) others = run.fitness;
  }
  frame.body =
      R"(<section id="compared"><h1 data-file="runs">Runs beside each other</h1><ul class="long" id="runs" data-live>)" +
      key + "</ul>";
  if (!others.empty()) {
    frame.body += R"(<p class="caution-box">Their fitnesses differ ()" +
                  html_escaped(runs.front().fitness + ", " + others) +
                  "): the lines cannot be held against each other.</p>";
  }
  frame.body += "<p>Best " + html_escaped(runs.front().fitness) +
                (runs.front().unit == "-" ? "" : ", in " + unit_html(runs.front().unit)) +
                ", of each " + term("generation", "generation") + ".</p>";
  frame.body +=
      R"(<div class="controls" id="compared-controls"></div><div id="compared-plot"></div>)";
  frame.body += kNoScript;
  frame.body +=
      R"(</section><section id="sides"><h2>Parameters side by side</h2><div id="side-table" data-live>)" +
      comparison_table(runs) + "</div></section>\n";
  return framed_page(std::move(frame), std::move(page), no_trials());
}

namespace {

std::string number_of_metric(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  return formatted("%.17g", value);
}

class MetricsPage {
 public:
  enum Type { kGauge, kCounter };
  // One value of metric `name` (without the program's prefix) with the labels `labels`, as
  // label() makes them, joined by commas.  Values of a metric follow one another.
  void add(const std::string& name, Type type, const std::string& help, const std::string& labels,
           double value) {
    if (name != last_) {
      last_ = name;
      text_ += "# HELP gapfarm_" + name + " " + help + "\n# TYPE gapfarm_" + name +
               (type == kGauge ? " gauge\n" : " counter\n");
    }
    text_ += "gapfarm_" + name + "{" + labels + "} " + number_of_metric(value) + "\n";
  }
  const std::string& text() const { return text_; }

  // KEY="VALUE", escaped.
  static std::string label(const std::string& key, const std::string& value) {
    std::string out = key + "=\"";
    for (const char c : value) {
      if (c == '\\' || c == '"') out += '\\';
      out += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
    }
    return out + "\"";
  }

 private:
  std::string text_;
  std::string last_;
};

using Metric = std::optional<double>;  // none: there is no line of it

struct MetricRow {
  const char* name;
  MetricsPage::Type type;
  const char* help;
  Metric (*of)(const WorkEntry& entry, double now_unix_s);
};

constexpr auto kGauge = MetricsPage::kGauge;
constexpr auto kCounter = MetricsPage::kCounter;

constexpr MetricRow kMetricRows[] = {
    {"running", kGauge, "1 while its process lives.",
     [](const WorkEntry& e, double) -> Metric { return e.running() ? 1 : 0; }},
    {"heartbeat_age_seconds", kGauge, "Since its process was last heard of.",
     [](const WorkEntry& e, double now_unix_s) -> Metric {
       return now_unix_s - e.heartbeat_unix_s;
     }},
    {"generation", kGauge, "Generations committed.",
     [](const WorkEntry& e, double) -> Metric { return static_cast<double>(e.generation); }},
    {"evaluations_total", kCounter, "Evaluations committed, since the run began.",
     [](const WorkEntry& e, double) -> Metric { return static_cast<double>(e.evaluations); }},
    {"evaluations_per_second", kGauge, "Of a command that is no run: simulations.",
     [](const WorkEntry& e, double) -> Metric { return e.running() ? e.rate_per_s : 0; }},
    {"tasks", kGauge, "Tasks of the generation or stage under way.",
     [](const WorkEntry& e, double) -> Metric {
       return static_cast<double>(e.running() ? e.total : 0);
     }},
    {"tasks_done", kGauge, "Those of them that are answered.",
     [](const WorkEntry& e, double) -> Metric {
       return static_cast<double>(e.running() ? e.done : 0);
     }},
    {"quarantined_total", kCounter, "Tasks that were given up.",
     [](const WorkEntry& e, double) -> Metric { return static_cast<double>(e.given_up); }},
    {"best_fitness", kGauge, "In its own sense and unit.",
     [](const WorkEntry& e, double) { return e.best; }},
    {"time_left_seconds", kGauge, "Until it is done.",
     [](const WorkEntry& e, double) { return e.running() ? e.time_left_s : Metric(); }},
};

void add_farms(const std::vector<WorkEntry>& entries, MetricsPage* page) {
  for (const char* state : {"busy", "idle", "gone"}) {
    for (const WorkEntry& e : entries) {
      if (!e.trouble.empty()) continue;
      page->add("workers", kGauge, "Workers by state.",
                MetricsPage::label("of", e.name) + "," + MetricsPage::label("state", state),
                static_cast<double>(in_state(e, state)));
    }
  }
  for (const FarmTally::Row& row : FarmTally::kRows) {
    for (const WorkEntry& e : entries) {
      if (e.kind != FoundWork::Kind::kRun || !e.trouble.empty()) continue;
      page->add(std::string(row.key) + "_total", kCounter,
                "What its farm coped with, over all masters.", MetricsPage::label("of", e.name),
                static_cast<double>(e.farm.*row.count));
    }
  }
}

}  // namespace

std::string metrics_text(const std::vector<WorkEntry>& entries, double now_unix_s) {
  MetricsPage page;
  for (const MetricRow& row : kMetricRows) {
    for (const WorkEntry& e : entries) {
      const auto value = e.trouble.empty() ? row.of(e, now_unix_s) : std::nullopt;
      if (value) page.add(row.name, row.type, row.help, MetricsPage::label("of", e.name), *value);
    }
  }
  add_farms(entries, &page);
  return page.text();
}

}  // namespace gapfarm
