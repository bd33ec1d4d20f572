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
#include "master/report/run/run_report.h"
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
  std::function<double()> cpu_now_s;  // of this thread: what pages cost
  std::function<Result<RunReport>(const RunQuestion&)> read_run;
  // One drive, measured and simulated, as JSON for the page (watch.js).
  std::function<Result<std::string>(const DriveQuestion&)> drive;
};

// / lists, /view?of=NAME shows one, /compare?of=A&of=B shows runs beside each other, /drive?of=RUN&
// trial=N&generation=G simulates, /events?at=PATH&... says when what is at PATH with the rest of
// the query is new, /metrics is for Prometheus.  A name is only looked up among those found: no
// address leads out of the folders.  What took long to make is good for long (good_for_s()):
// however often it is asked for, making pages takes about a hundredth of the time.
class Site {
 public:
  explicit Site(SiteSources sources)
      : sources_(std::move(sources)), known_entries_(sources_.unix_now_s, sources_.cpu_now_s) {}

  HttpResponse answer(const HttpRequest& request);

 private:
  struct Kept {  // a page
    std::string tag, html, state;
    double made_unix_s = 0, cost_s = 0;
  };
  void look();
  const FoundWork* find(const std::string& name) const;
  const WorkEntry& entry(const FoundWork& found) const;
  HttpResponse answer_at(const Target& target, const std::string& known);
  HttpResponse events(const Target& target);
  HttpResponse drive(const Target& target);
  HttpResponse metrics() const;

  // Of / , /view and /compare.  What a page is of: equal, when the page would be.
  struct Standing {
    std::string tag;
    std::string state;  // of what is shown: what changes it is sent at once
  };
  Result<Standing> standing(const Target& target) const;
  Result<std::string> made(const Target& target) const;
  HttpResponse shown(const Target& target, const std::string& known);
  static HttpResponse as_asked(const Kept& page, const std::string& known);
  HttpResponse trouble(const Target& target, const Error& error) const;
  Result<std::string> view(const Target& target) const;
  Result<std::string> compare(const Target& target) const;
  // The kept page at `target`, if it is still good.
  const Kept* kept(const std::string& key, const Standing& now) const;
  void keep(const std::string& key, Kept page);

  SiteSources sources_;
  double searched_unix_s_ = 0, search_cost_s_ = 0;
  double looked_unix_s_ = 0, look_cost_s_ = 0;
  std::vector<FoundWork> found_;
  WorkEntries known_entries_;
  std::vector<WorkEntry> entries_;  // as found_
  std::map<std::string, Kept> kept_;
};

}  // namespace gapfarm
