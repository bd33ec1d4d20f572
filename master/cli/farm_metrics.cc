#include "master/cli/farm_metrics.h"

#include <map>

#include "master/metrics/metrics_server.h"

namespace gapfarm {
namespace {

double real(std::uint64_t count) { return static_cast<double>(count); }

void add_workers(const SocketFarm& farm, MetricsPage* page) {
  std::map<std::string, double> by_state = {{"busy", 0}, {"idle", 0}, {"gone", 0}};
  for (const WorkerStatus& worker : farm.workers()) by_state[worker.state] += 1;
  for (const auto& [state, count] : by_state) {
    page->add_labelled("workers", MetricsPage::kGauge, "Workers by state.", "state", state, count);
  }
}

}  // namespace

std::string metrics_page(const SocketFarm& farm, const Progress& progress,
                         const RunFigures& figures) {
  constexpr auto kGauge = MetricsPage::kGauge;
  constexpr auto kCounter = MetricsPage::kCounter;
  MetricsPage page;
  page.add("generation", kGauge, "Generations committed.", real(figures.generation));
  page.add("evaluations_total", kCounter, "Evaluations since this master started.",
           real(figures.evaluations));
  page.add("evaluations_per_second", kGauge, "Mean since this master started.",
           progress.rate_per_s);
  page.add("tasks", kGauge, "Tasks of the generation under way.", real(progress.total));
  page.add("tasks_done", kGauge, "Those of them that are answered.", real(progress.done));
  if (figures.best) {
    page.add("best_fitness", kGauge, "Of the last generation, in its own sense.", *figures.best);
  }
  if (progress.time_left_s) {
    page.add("time_left_seconds", kGauge, "Until the run's last generation.",
             *progress.time_left_s);
  }
  add_workers(farm, &page);
  const SchedulerCounts& counts = farm.counts();
  page.add("retries_total", kCounter, "Jobs given out again.", real(counts.retries));
  page.add("copies_total", kCounter, "Jobs given to a second worker because the first took long.",
           real(farm.copied()));
  page.add("compared_results_total", kCounter, "Answers held against another worker's.",
           real(farm.compared()));
  page.add("alarms_total", kCounter, "Those of them that differed.", real(counts.disagreements));
  page.add("hung_total", kCounter, "Workers killed because their simulation hung.",
           real(counts.hung));
  page.add("late_results_total", kCounter, "Answers to jobs that had one.", real(counts.late));
  page.add("foreign_results_total", kCounter, "Answers to nothing that was asked.",
           real(counts.foreign));
  page.add("malformed_messages_total", kCounter, "Messages that made no sense.",
           real(counts.malformed));
  page.add("quarantined_total", kCounter, "Tasks that were given up.", real(counts.quarantined));
  const LinkCounts links = farm.link_counts();
  page.add("links_open", kGauge, "TCP connections now.", real(links.open));
  page.add("links_accepted_total", kCounter, "TCP connections.", real(links.accepted));
  page.add("links_refused_keys_total", kCounter, "Handshakes with keys that are not listed.",
           real(links.refused_keys));
  page.add("links_failed_handshakes_total", kCounter, "Handshakes that failed.",
           real(links.failed_handshakes));
  page.add("links_dropped_total", kCounter, "Connections closed by the limits.",
           real(links.dropped));
  return page.text();
}

}  // namespace gapfarm
