// The pages that a server makes by itself.  The others are those that commands write.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/report/run/run_report.h"
#include "master/serve/found.h"

namespace gapfarm {

// Which entries a list shows, as its address says.
struct ListView {
  std::string sort;  // "name", "state", "best", "trials", "seed", "config"; else latest first
  std::string
      query;  // each in an entry's name, command, config, seed or headline, whatever the case
  std::string state;  // empty: any
};
std::string list_page(std::vector<WorkEntry> entries, const ListView& view,
                      const std::vector<std::string>& folders);

// A diagnosis, a comparison or a study: its stages, how far it is, its workers.
Result<std::string> command_page(const FoundWork& found, double now_unix_s);

// What cannot be shown, and why; while it is open it looks again.
std::string trouble_page(const std::string& what, const std::string& why);

// Their best fitness in one plot, their parameters side by side.  REQUIRES: one at least.
std::string compare_page(std::span<const RunReport> runs);

// Prometheus' text format.
std::string metrics_text(const std::vector<WorkEntry>& entries, double now_unix_s);

}  // namespace gapfarm
