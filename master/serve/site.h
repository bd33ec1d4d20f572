// The pages that `gapfarm serve` shows: which address is what, and when it has changed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/report/run/run_report.h"
#include "master/serve/request.h"
#include "master/store/records.h"

namespace gapfarm {

// What lies beneath the folders that a page is of: runs, diagnoses, comparisons and the like, live
// or dead, from their stores alone.
struct FoundWork {
  enum class Kind { kRun, kDiagnosis, kCommand };
  Kind kind = Kind::kRun;
  std::string name;            // how it is shown and asked for: the path as it was found
  std::filesystem::path path;  // its folder
};

// Folders down to four beneath each of `roots`, in order of their names; hidden ones and symbolic
// links are omitted.  At most 2,000, of at most 50,000 files.
std::vector<FoundWork> find_work(const std::vector<std::filesystem::path>& roots);

// When what is in `folder` last changed, as far as its size and times show: equal stamps, equal
// content.
std::string stamp_of(const std::filesystem::path& folder);

// One line of the list.
struct WorkEntry : LiveStatus {
  FoundWork::Kind kind = FoundWork::Kind::kRun;
  std::string name;
  std::string what;         // "run", "diagnosis", "compare"
  std::string status_text;  // the headline, why it stopped or what it waits for
  std::string fitness, unit;
  bool higher_is_better = true;
  std::optional<double> best;
  std::vector<double> best_by_generation;  // those that there are, at most 60
  std::uint64_t generation = 0, evaluations = 0;
  std::size_t trials = 0;
  std::uint64_t seed = 0;
  std::string config;
  std::uint64_t given_up = 0;  // tasks
  FarmTally farm;              // of a run, over all its masters
  std::string trouble;         // why it cannot be read
  std::string stamp;           // stamp_of() its folder, when it was read
};

// How long what took so much CPU time to work out is good for: work is a hundredth of the time.
inline double good_for_s(double cost_s) { return 100 * cost_s; }

// WorkEntries, each read again when its folder changed or its master may have died, but none more
// often than good_for_s() allows.
class WorkEntries {
 public:
  WorkEntries(std::function<double()> unix_now_s, std::function<double()> cpu_now_s)
      : unix_now_s_(std::move(unix_now_s)), cpu_now_s_(std::move(cpu_now_s)) {}

  std::vector<WorkEntry> now(const std::vector<FoundWork>& found);

 private:
  struct Known {
    double read_unix_s = 0, cost_s = 0;
    WorkEntry entry;
  };
  bool holds(const Known& known, const std::string& stamp, double now_unix_s) const;

  std::function<double()> unix_now_s_, cpu_now_s_;
  std::map<std::string, Known> known_;
};

// Which entries a list shows, as its address says.
struct ListView {
  std::string sort;   // "name", "state", "best", "trials", "seed", "config"; else latest first
  std::string query;  // in an entry's name, command, config, seed or headline, whatever the case
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
