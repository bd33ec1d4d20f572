// The pages that `gapfarm serve` shows: which address is what, and when it has changed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/report/run_report.h"
#include "master/serve/found.h"
#include "master/serve/request.h"

namespace gapfarm {

struct DriveQuestion {
  std::filesystem::path run;
  std::size_t trial = 0;                    // index in the run's log
  std::optional<std::uint64_t> generation;  // none: the last
};

struct SiteSources {
  std::vector<std::filesystem::path> folders;
  std::function<double()> unix_now_s;
  std::function<Result<RunReport>(const std::filesystem::path&)> read_run;
  // One drive, measured and simulated, as JSON for the page (watch.js).
  std::function<Result<std::string>(const DriveQuestion&)> drive;
};

// / lists, /view?of=NAME shows one, /compare?of=A&of=B shows runs beside each other, /drive?of=RUN&
// trial=N&generation=G simulates, /metrics is for Prometheus.  A name is only looked up among those
// found: no address leads out of the folders.
class Site {
 public:
  explicit Site(SiteSources sources) : sources_(std::move(sources)) {}

  HttpResponse answer(const HttpRequest& request);

 private:
  void look();
  const FoundWork* find(const std::string& name) const;
  const WorkEntry& entry(const FoundWork& found) const;
  HttpResponse page_at(const Target& target, const std::string& known);
  HttpResponse list(const Target& target, const std::string& known) const;
  HttpResponse view(const Target& target, const std::string& known);
  HttpResponse compare(const Target& target, const std::string& known);
  HttpResponse drive(const Target& target);
  HttpResponse no_such(const std::string& name) const;

  SiteSources sources_;
  double searched_unix_s_ = 0;
  std::vector<FoundWork> found_;
  WorkEntries known_entries_;
  std::vector<WorkEntry> entries_;  // as found_
};

}  // namespace gapfarm
