// How far a command of several stages is, and how long the whole of it will still take.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace gapfarm {

struct ProgressStage {
  std::string name;         // "screen the catalogue"
  double share = 1;         // of the whole command's time, in any unit; a guess
  std::uint64_t tasks = 0;  // that it will ask; 0: only it knows, so its own time is the guide
};

// How a study reports its stages to its caller; either may be empty.
struct StageHooks {
  // Before the first stage: all of them.
  std::function<void(std::vector<ProgressStage>)> plan;
  // Stage `k` of them begins, or goes on with more: see OverallProgress::begin().
  std::function<void(std::size_t k, std::uint64_t tasks)> begin;

  void planned(std::vector<ProgressStage> stages) const {
    if (plan) plan(std::move(stages));
  }
  void began(std::size_t k, std::uint64_t tasks = 0) const {
    if (begin) begin(k, tasks);
  }
};

// What is known of it now.
struct ProgressView {
  std::string stage;
  std::size_t number = 0, stages = 0;  // of the stage, from 1; 0: none has begun
  std::uint64_t done = 0, total = 0;   // tasks of the stage; total 0: unknown
  double share = 0;                    // of the whole, [0, 1]; never goes back
  double rate_per_s = 0;               // tasks simulated, mean since the stage began
  std::optional<double> time_left_s;   // of the whole; none before there is a pace to go by
  std::uint64_t remembered = 0, simulated = 0;  // tasks of all stages
};

// Times are seconds of one clock of the caller's.  The pace is that of what was simulated: tasks
// whose answers were at hand take no time worth counting.
class OverallProgress {
 public:
  explicit OverallProgress(std::vector<ProgressStage> stages);

  // Stage `k` begins; those before it are over.  `tasks`, if not 0, replaces the plan's.  When it
  // is in work already, it has so many more, and the whole is longer.
  void begin(std::size_t k, double now_s, std::uint64_t tasks = 0);
  // The stage with this name; false: there is none, and nothing changes.
  bool begin(const std::string& name, double now_s);
  // Tasks of the present stage that are answered, in all since it began.
  void answered(std::uint64_t remembered, std::uint64_t simulated);
  // The present stage turns out to have so many tasks.
  void expect(std::uint64_t tasks);

  ProgressView at(double now_s) const;
  const std::vector<ProgressStage>& stages() const { return stages_; }

 private:
  struct Passed {
    double share = 0;  // of the stage, done
    double fresh = 0;  // of it, what had to be simulated
  };
  Passed present(double now_s) const;
  double fresh_part() const;

  std::vector<ProgressStage> stages_;
  double whole_ = 0;  // sum of shares
  bool begun_ = false;
  std::size_t stage_ = 0;
  double first_s_ = 0, stage_s_ = 0;              // when the first and the present stage began
  double behind_ = 0, behind_fresh_ = 0;          // shares of the stages before the present one
  std::uint64_t remembered_ = 0, simulated_ = 0;  // of the present stage
  std::uint64_t remembered_before_ = 0, simulated_before_ = 0;  // of those before
  mutable double shown_ = 0;
};

// "stage 3 of 6, screen the catalogue: 41 % done, 85/s, about 2 min 10 s left".  A command of one
// stage is not numbered, and known tasks are counted: "evaluate: 410 of 1000, ...".
std::string progress_line(const ProgressView& view);

// When a line that stays is due: at once, and then every `interval_s`.
class LineCadence {
 public:
  explicit LineCadence(double interval_s = 60) : interval_s_(interval_s) {}
  bool due(double now_s) {
    if (last_s_ && now_s - *last_s_ < interval_s_) return false;
    last_s_ = now_s;
    return true;
  }

 private:
  double interval_s_;
  std::optional<double> last_s_;
};

class WorkerWait {
 public:
  // `endpoints`: where workers may come; none: the master's own are all there will be.
  explicit WorkerWait(const std::vector<std::string>& endpoints);

  // None while there are workers, and at first: they are on their way then, local ones take a
  // while. After half a minute the words say how to start one.  Times are of one clock of the
  // caller's.
  std::optional<std::string> message(std::size_t workers, double now_s);

 private:
  std::string where_;    // "at tcp://..."
  std::string connect_;  // an endpoint for gapfarm-worker; empty: only local workers
  std::optional<double> since_s_;
};

// What a long command has found so far, for those who watch it: what it ends with may differ.
struct Finding {
  std::string about;  // "the noise": a later finding about the same takes its place
  std::string text;   // sentences
  // A small table; empty: none.
  std::pair<std::string, std::string> columns;  // what stands above them, with the unit
  std::vector<std::pair<std::string, std::string>> rows;
};

using OnFinding = std::function<void(Finding)>;

// Which stage is on, and how long each took.
class StageClock {
 public:
  explicit StageClock(std::function<void(const std::string&)> on_stage)
      : on_stage_(std::move(on_stage)) {}

  // Ends the present one; empty: none begins.
  void begin(const std::string& name) {
    const auto now = std::chrono::steady_clock::now();
    if (!present.empty()) {
      timing_s.emplace_back(present, std::chrono::duration<double>(now - began_).count());
    }
    present = name;
    began_ = now;
    if (on_stage_ && !name.empty()) on_stage_(name);
  }

  std::string present;
  std::vector<std::pair<std::string, double>> timing_s;

 private:
  std::function<void(const std::string&)> on_stage_;
  std::chrono::steady_clock::time_point began_;
};

}  // namespace gapfarm
