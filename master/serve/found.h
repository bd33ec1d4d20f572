// What lies beneath the folders that a page is of: runs, diagnoses, comparisons and the like, live
// or dead, from their stores alone.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "master/store/records.h"

namespace gapfarm {

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
struct WorkEntry {
  FoundWork::Kind kind = FoundWork::Kind::kRun;
  std::string name;
  std::string what;         // "run", "diagnosis", "compare"
  std::string state;        // "running", "finished", "stopped", "failed"
  std::string status_text;  // the headline, why it stopped or what it waits for
  std::string fitness, unit;
  bool higher_is_better = true;
  std::optional<double> best;
  std::vector<double> best_by_generation;  // those that there are, at most 60
  std::uint64_t generation = 0, evaluations = 0;
  std::size_t trials = 0;
  std::uint64_t seed = 0;
  std::string config;
  double rate_per_s = 0;
  std::optional<double> time_left_s;
  std::optional<double> share;              // of a command, [0, 1]
  std::size_t workers = 0;                  // that are there
  std::uint64_t given_up = 0;               // tasks
  std::uint64_t tasks = 0, tasks_done = 0;  // of the generation or stage under way
  std::map<std::string, unsigned> workers_by_state;
  FarmTally farm;  // of a run, over all its masters
  double changed_unix_s = 0;
  std::string trouble;  // why it cannot be read
  std::string stamp;    // stamp_of() its folder, when it was read
};

// Never fails: what cannot be read says so in `trouble`.
WorkEntry entry_of(const FoundWork& found, double now_unix_s);

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

}  // namespace gapfarm
