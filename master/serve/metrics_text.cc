#include <cmath>
#include <string>

#include "common/base/text.h"
#include "master/serve/pages.h"

namespace gapfarm {
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

struct MetricRow {
  const char* name;
  MetricsPage::Type type;
  const char* help;
  double (*of)(const WorkEntry& entry, double now_unix_s);
};

constexpr auto kGauge = MetricsPage::kGauge;
constexpr auto kCounter = MetricsPage::kCounter;

constexpr MetricRow kMetricRows[] = {
    {"running", kGauge, "1 while its process lives.",
     [](const WorkEntry& e, double) { return e.state == "running" ? 1.0 : 0.0; }},
    {"heartbeat_age_seconds", kGauge, "Since its process was last heard of.",
     [](const WorkEntry& e, double now_unix_s) { return now_unix_s - e.changed_unix_s; }},
    {"generation", kGauge, "Generations committed.",
     [](const WorkEntry& e, double) { return static_cast<double>(e.generation); }},
    {"evaluations_total", kCounter, "Evaluations committed, since the run began.",
     [](const WorkEntry& e, double) { return static_cast<double>(e.evaluations); }},
    {"evaluations_per_second", kGauge, "Of a command that is no run: simulations.",
     [](const WorkEntry& e, double) { return e.rate_per_s; }},
    {"tasks", kGauge, "Tasks of the generation or stage under way.",
     [](const WorkEntry& e, double) { return static_cast<double>(e.tasks); }},
    {"tasks_done", kGauge, "Those of them that are answered.",
     [](const WorkEntry& e, double) { return static_cast<double>(e.tasks_done); }},
    {"quarantined_total", kCounter, "Tasks that were given up.",
     [](const WorkEntry& e, double) { return static_cast<double>(e.given_up); }},
};

void add_optional(const std::vector<WorkEntry>& entries, const char* name, const char* help,
                  std::optional<double> WorkEntry::*value, MetricsPage* page) {
  for (const WorkEntry& e : entries) {
    if (!e.trouble.empty() || !(e.*value)) continue;
    page->add(name, kGauge, help, MetricsPage::label("of", e.name), *(e.*value));
  }
}

void add_farms(const std::vector<WorkEntry>& entries, MetricsPage* page) {
  for (const char* state : {"busy", "idle", "gone"}) {
    for (const WorkEntry& e : entries) {
      if (!e.trouble.empty()) continue;
      const auto count = e.workers_by_state.find(state);
      page->add("workers", kGauge, "Workers by state.",
                MetricsPage::label("of", e.name) + "," + MetricsPage::label("state", state),
                count == e.workers_by_state.end() ? 0 : count->second);
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
      if (!e.trouble.empty()) continue;
      page.add(row.name, row.type, row.help, MetricsPage::label("of", e.name),
               row.of(e, now_unix_s));
    }
  }
  add_optional(entries, "best_fitness", "In its own sense and unit.", &WorkEntry::best, &page);
  add_optional(entries, "time_left_seconds", "Until it is done.", &WorkEntry::time_left_s, &page);
  add_farms(entries, &page);
  return page.text();
}

}  // namespace gapfarm
