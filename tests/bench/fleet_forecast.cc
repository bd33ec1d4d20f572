// The autoscaler on a simulated cluster: figures a seed on stdout, the picture of
// docs/launching.md.
//   fleet_forecast --picture docs/pictures/autoscaler.svg
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <fstream>

#include "master/report/figures/figures.h"
#include "tests/bench/fleet_simulation.h"

namespace {

std::string picture(const gapfarm::FleetOutcome& outcome) {
  gapfarm::LineChart chart;
  chart.title = "10,000 cores, jobs of an hour, a site that allows 900 jobs of 8";
  chart.x_title = "minutes";
  chart.y_title = "workers";
  chart.series = {{"wanted", {}, {}, {}}, {"running", {}, {}, {}}, {"queued", {}, {}, {}}};
  for (const gapfarm::FleetMoment& moment : outcome.moments) {
    const double minutes = moment.at_s / 60;
    chart.series[0].line.push_back({minutes, static_cast<double>(moment.wanted)});
    chart.series[1].line.push_back({minutes, static_cast<double>(moment.running)});
    chart.series[2].line.push_back({minutes, static_cast<double>(moment.queued)});
  }
  return gapfarm::line_chart(chart);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("What the autoscaler costs on a simulated cluster.");
  std::string file;
  app.add_option("--picture", file, "SVG of the second seed")->required();
  CLI11_PARSE(app, argc, argv);
  std::printf("seed   cost over oracle   span, s   jobs   submissions   refused   at most\n");
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const gapfarm::FleetOutcome outcome = gapfarm::simulate_fleet(gapfarm::large_fleet(seed));
    std::printf("%4d   %16.3f   %7.0f   %4u   %11u   %7u   %7u\n", static_cast<int>(seed),
                outcome.paid_s / outcome.oracle_s, outcome.span_s, outcome.jobs,
                outcome.submissions, outcome.refusals, outcome.most_workers);
    if (seed == 2) std::ofstream(file) << picture(outcome);
  }
  return 0;
}
