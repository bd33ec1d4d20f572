// render_example FOLDER: writes the pages that the browser test opens.
#include <cmath>
#include <fstream>
#include <iostream>

#include "master/report/report_html.h"
#include "master/report/run/run_report.h"
#include "tests/unit/report/example_diagnosis.h"

namespace gapfarm {
namespace {

// A run as long as a long night's: 2,000 generations.
RunReport example_run() {
  RunReport run;
  run.name = "run/demo";
  run.headline = "Best log_score 10.8675 nats/trial after 2000 generations";
  run.action = "Widen the range of contact_length in [genes]: the best value lies at its end.";
  run.fitness = "log_score";
  run.unit = "nats/trial";
  for (std::uint64_t g = 1; g <= 2000; ++g) {
    const double t = static_cast<double>(g);
    const double best = 10.9 - 8 * std::exp(-t / 200);
    run.generations.push_back(
        {g, best, best - 6 * std::exp(-t / 400), best - 30 * std::exp(-t / 600), 24 * g, 0.6 * t});
  }
  run.parameters = example_diagnosis().parameters;
  run.outcome.emplace();
  run.outcome->trials = example_diagnosis().trials;
  run.outcome->validation = {{"the config's own values", 3.2}, {"the best", 9.4}};
  run.outcome->baselines = {{"constant motion", 6.695}};
  return run;
}

bool write(const std::string& path, const std::string& html) {
  std::ofstream file(path, std::ios::binary);
  file << html;
  return static_cast<bool>(file.flush());
}

}  // namespace
}  // namespace gapfarm

int main(int argc, char** argv) {
  using namespace gapfarm;
  if (argc != 2) {
    std::cerr << "usage: render_example FOLDER\n";
    return 2;
  }
  const std::string folder = argv[1];
  Diagnosis hostile = null_diagnosis();
  const std::string attack =
      "</script><script>document.title='pwned'</script><img src=x onerror=alert(1)>\"'&";
  hostile.headline = hostile.trials.front().session = hostile.trials.front().command = attack;
  hostile.where = {{attack, attack, attack, attack, 1, 1, 1, attack}};
  hostile.provenance = {{attack, attack}};
  Diagnosis empty;
  Diagnosis unusable;
  unusable.verdict = Verdict::kUnusable;
  unusable.headline = "Not usable as it is: left and right are exchanged.";
  unusable.sanity = {{"axes_swapped", "Forward drives go sideways.", "Exchange x and y."}};
  for (const auto& [name, diagnosis] : {std::pair{"example", example_diagnosis()},
                                        {"null", null_diagnosis()},
                                        {"hostile", hostile},
                                        {"empty", empty},
                                        {"unusable", unusable}}) {
    if (!write(folder + "/" + name + ".html", report_html(diagnosis))) {
      std::cerr << "cannot write to " << folder << "\n";
      return 1;
    }
  }
  RunReport begun;
  begun.name = "run/begun";
  begun.without_outcome = "How the best moves is worked out when a run ends.";
  const bool written = write(folder + "/run.html", run_html(example_run())) &&
                       write(folder + "/run-begun.html", run_html(begun));
  return written ? 0 : 1;
}
