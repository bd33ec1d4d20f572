// The trial and path readers: no crash, errors with places, what is read writes back the same.
#include <cmath>
#include <vector>

#include "common/trials/context.h"
#include "common/trials/read.h"
#include "common/trials/text/trial_parser.h"
#include "tests/fuzz/fuzz_target.h"

namespace gapfarm {
namespace {

const std::vector<std::string> kCommands = {"forward", "backward", "turn_ccw",
                                            "turn_cw", "wide_ccw", "wide_cw"};

void check_trials(std::string_view text) {
  const auto log = parse_trials(text, "f", kCommands);
  if (!log.ok()) {
    promise_place(log.error().message, "f");
    return;
  }
  promise(!log->trials.empty(), "a log has trials");
  for (const Trial& trial : log->trials) {
    promise(std::isfinite(trial.X_WS.x) && std::isfinite(trial.X_WE.theta), "poses are finite");
    promise(trial.extra.size() == log->extra_columns.size(), "an extra value a column");
  }
  const std::string written = format_trials(*log);
  const auto again = parse_trials(written, "g", kCommands);
  promise(again.ok(), again.ok() ? "" : again.error().message.c_str());
  promise(format_trials(*again) == written, "logs read back as they were written");
  trial_contexts(*log, std::vector<DrivenCommand>(log->trials.size(), {1, 1, 1}));
}

void check_paths(std::string_view text) {
  TrialLog log;
  Trial trial;
  trial.session = "s1";
  log.trials.push_back(trial);
  Mistakes mistakes(false);
  add_paths(text, "f", {&log}, mistakes);
  if (!mistakes.status().ok()) promise(log.trials[0].path.empty(), "nothing is half-read");
}

}  // namespace
}  // namespace gapfarm

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  gapfarm::check_trials(gapfarm::bytes_of(data, size));
  gapfarm::check_paths(gapfarm::bytes_of(data, size));
  return 0;
}
