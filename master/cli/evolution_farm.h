// Where the evolution loop meets the farm and the run store.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/log/log.h"
#include "common/problem/problem.h"
#include "master/cli/console.h"
#include "master/evolve/evolve.h"
#include "master/evolve/time_left.h"
#include "master/farm/socket_farm.h"
#include "master/progress/worker_wait.h"
#include "master/store/run_store.h"

namespace gapfarm {

// Keeps what a farm reports in the store, besides what `options` does with it: at once what was
// lost or is contradictory (of the alarms only the first hundred: each costs a disk write, and a
// machine that computes wrongly raises one after the other), at the next flush() who came and went.
// `store` and `console` outlive it, and it the farm.
class FarmEventKeeper {
 public:
  FarmEventKeeper(RunStore& store, Console& console) : store_(store), console_(console) {}

  void listen(SocketFarmOptions& options);
  void flush();

 private:
  void keep(const FarmEvent& event);

  RunStore& store_;
  Console& console_;
  unsigned alarms_ = 0;
  std::size_t kept_ = 0;                      // of who came and went
  std::map<std::string, std::string> hosts_;  // of workers that are there
  std::vector<StoredWorkerEvent> waiting_;
};

// Keeps the store's live row and the terminal's progress line fresh, about once a second.
class FarmProgressWriter {
 public:
  // `resumed`: where the run goes on; none at its start.
  FarmProgressWriter(RunStore& store, const SocketFarm& farm, const EvolutionSettings& settings,
                     const std::optional<Checkpoint>& resumed, const EvolveClock& clock,
                     Console& console);

  void on_progress(const FarmProgress& progress);
  void on_generation(const GenerationRecord& record, std::optional<double> best);
  // As last shown, with the farm's counts as they are now.
  Progress now() const;
  // Where generations also go, and what is written when the live row is; neither is owned.
  void watch(Log* log, FarmEventKeeper* events);

 private:
  void refresh(double now_s);
  std::string words(const Pace& pace) const;

  RunStore& store_;
  const SocketFarm& farm_;
  const EvolutionSettings& settings_;
  const EvolveClock& clock_;
  Console& console_;
  double began_s_;
  double written_s_ = -1e9;
  std::uint64_t evaluations_before_ = 0;     // of this life of the master, generations done
  std::uint64_t generations_ = 0;            // of this life of the master
  std::uint64_t generation_ = 0;             // of the run
  std::uint64_t evaluations_of_others_ = 0;  // of earlier masters
  double wall_of_others_s_ = 0;
  std::string best_;
  Progress last_;
  Log* log_ = nullptr;
  FarmEventKeeper* events_ = nullptr;
  WorkerWait wait_;
};

// Candidates to EvaluateTasks and back.
class FarmBackend : public EvaluationBackend {
 public:
  FarmBackend(SocketFarm& farm, const Problem& problem, std::uint64_t seed,
              FarmProgressWriter& progress);
  Result<std::vector<Score>> evaluate(std::span<const Candidate> candidates) override;

 private:
  SocketFarm& farm_;
  FitnessKind fitness_;
  std::uint64_t seed_;
  FarmProgressWriter& progress_;
  std::string problem_hash_;
};

class StoreSink : public GenerationSink {
 public:
  StoreSink(RunStore& store, const Problem& problem, const SocketFarm& farm,
            FarmProgressWriter& progress)
      : store_(store), problem_(problem), farm_(farm), progress_(progress) {}
  Status commit(const GenerationRecord& record) override;
  // Tasks that this master's farm gave up, of the generations committed here.
  std::uint64_t quarantined() const { return quarantined_; }

 private:
  RunStore& store_;
  const Problem& problem_;
  const SocketFarm& farm_;
  FarmProgressWriter& progress_;
  std::uint64_t quarantined_ = 0;
};

}  // namespace gapfarm
