// Where the evolution loop meets the farm and the run store.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/log/log.h"
#include "common/problem/problem.h"
#include "common/progress/overall_progress.h"
#include "common/trials/trial.h"
#include "master/evolve/evolve.h"
#include "master/farm/scheduler.h"
#include "master/store/run_store.h"

namespace gapfarm {

// What those who watch a run hear while it goes on.
class RunWatcher {
 public:
  virtual ~RunWatcher() = default;
  virtual void note(std::string_view) {}
  // The run goes on all the same.
  virtual void error(const Error&) {}
  // In place of the last one; `news`: it is not just more of the same.  Empty: there is none now.
  virtual void progress(std::string_view, bool /*news*/) {}
  // A log that the run takes beside its own.
  virtual void read(const TrialLog&) {}
};

// Keeps what a farm reports in the store: at once what was lost or is contradictory (of the alarms
// only the first hundred: each costs a disk write, and a machine that computes wrongly raises one
// after the other), at the next flush() who came and went.  `store` and `watcher` outlive it, and
// it the farm.
class FarmEventKeeper {
 public:
  FarmEventKeeper(RunStore& store, RunWatcher& watcher) : store_(store), watcher_(watcher) {}

  void keep(const FarmEvent& event);
  void flush();

 private:
  RunStore& store_;
  RunWatcher& watcher_;
  unsigned alarms_ = 0;
  std::size_t kept_ = 0;                      // of who came and went
  std::map<std::string, std::string> hosts_;  // of workers that are there
  std::vector<StoredWorkerEvent> waiting_;
};

// Keeps the store's live row and the watcher's progress line fresh, about once a second.
class FarmProgressWriter {
 public:
  // `resumed`: where the run goes on; none at its start.  `spent_s`: wall time of the run until
  // now.
  FarmProgressWriter(RunStore& store, Farm& farm, const EvolutionSettings& settings,
                     const std::optional<Checkpoint>& resumed, double spent_s,
                     const EvolveClock& clock, RunWatcher& watcher);

  // Evaluations of the generations that this life of the master has committed.
  std::uint64_t evaluations_before() const { return evaluations_before_; }
  // Of what was asked when there were so many of these.
  void on_progress(const FarmProgress& progress, std::uint64_t evaluations_before);
  void on_generation(const GenerationRecord& record, std::optional<double> best);
  // Evaluations of the generation in work that a user's program had no answer to, in a sentence.
  void on_failures(const std::string& text);
  const std::string& failure() const { return failure_; }  // the last of these; empty: none
  // As last shown, with the farm's counts as they are now.
  Progress now() const;
  // Where generations also go, and what is written when the live row is; neither is owned.
  void watch(Log* log, FarmEventKeeper* events);

 private:
  void refresh(double now_s);
  std::string message(const Pace& pace) const;

  RunStore& store_;
  Farm& farm_;
  const EvolutionSettings& settings_;
  const EvolveClock& clock_;
  RunWatcher& watcher_;
  double began_s_, spent_before_s_;
  double written_s_ = -1e9;
  std::uint64_t evaluations_before_ = 0;     // of this life of the master, generations done
  std::uint64_t generations_ = 0;            // of this life of the master
  std::uint64_t generation_ = 0;             // of the run
  std::uint64_t evaluations_of_others_ = 0;  // of earlier masters
  std::string best_;
  Progress last_;
  Log* log_ = nullptr;
  FarmEventKeeper* events_ = nullptr;
  unsigned failures_ = 0;  // generations with some
  std::string failure_;
  WorkerWait wait_;
};

// Candidates to EvaluateTasks and back.  The arguments outlive it.
ScoreCandidates farm_scores(Farm& farm, const Problem& problem, std::uint64_t seed,
                            FarmProgressWriter& progress);

// Keeps generations in the store.
class StoreSink {
 public:
  StoreSink(RunStore& store, const Problem& problem, const Farm& farm, FarmProgressWriter& progress)
      : store_(store), problem_(problem), farm_(farm), progress_(progress) {}
  Status commit(const GenerationRecord& record);
  // Tasks that this master's farm gave up, of the generations committed here.
  std::uint64_t quarantined() const { return quarantined_; }

 private:
  RunStore& store_;
  const Problem& problem_;
  const Farm& farm_;
  FarmProgressWriter& progress_;
  std::uint64_t quarantined_ = 0;
};

}  // namespace gapfarm
