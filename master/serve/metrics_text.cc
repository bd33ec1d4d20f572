#include "master/metrics/metrics_server.h"
#include "master/serve/pages.h"

namespace gapfarm {
namespace {

struct MetricRow {
  const char* name;
  MetricsPage::Type type;
  const char* help;
  double (*of)(const WorkEntry& entry, double now_unix_s);
};

constexpr MetricRow kMetricRows[] = {
    {"run_running", MetricsPage::kGauge, "1 while its process lives.",
     [](const WorkEntry& e, double) { return e.state == "running" ? 1.0 : 0.0; }},
    {"run_generation", MetricsPage::kGauge, "Generations committed.",
     [](const WorkEntry& e, double) { return static_cast<double>(e.generation); }},
    {"run_evaluations_total", MetricsPage::kCounter, "Evaluations committed.",
     [](const WorkEntry& e, double) { return static_cast<double>(e.evaluations); }},
    {"run_rate_per_second", MetricsPage::kGauge, "Evaluations or simulations.",
     [](const WorkEntry& e, double) { return e.rate_per_s; }},
    {"run_workers", MetricsPage::kGauge, "Workers that are there.",
     [](const WorkEntry& e, double) { return static_cast<double>(e.workers); }},
    {"run_given_up_total", MetricsPage::kCounter, "Tasks given up.",
     [](const WorkEntry& e, double) { return static_cast<double>(e.given_up); }},
    {"run_alarms_total", MetricsPage::kCounter, "Answers that differed.",
     [](const WorkEntry& e, double) { return static_cast<double>(e.alarms); }},
    {"run_heartbeat_age_seconds", MetricsPage::kGauge, "Since its process was last heard of.",
     [](const WorkEntry& e, double now_unix_s) { return now_unix_s - e.changed_unix_s; }},
};

// As Prometheus' text format wants the value of a label.
std::string label_of(const std::string& name) {
  std::string out;
  for (const char c : name) {
    if (c == '\\' || c == '"') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
  }
  return out;
}

}  // namespace

std::string metrics_text(const std::vector<WorkEntry>& entries, double now_unix_s) {
  MetricsPage page;
  for (const MetricRow& row : kMetricRows) {
    for (const WorkEntry& e : entries) {
      if (!e.trouble.empty()) continue;
      page.add_labelled(row.name, row.type, row.help, "of", label_of(e.name),
                        row.of(e, now_unix_s));
    }
  }
  for (const WorkEntry& e : entries) {
    if (!e.best) continue;
    page.add_labelled("run_best_fitness", MetricsPage::kGauge, "In its own sense and unit.", "of",
                      label_of(e.name), *e.best);
  }
  return page.text();
}

}  // namespace gapfarm
