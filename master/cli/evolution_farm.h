// Where the evolution loop meets the farm and the run store.
#pragma once

#include <optional>
#include <string>

#include "common/log/log.h"
#include "common/problem/problem.h"
#include "master/cli/console.h"
#include "master/evolve/evolve.h"
#include "master/evolve/time_left.h"
#include "master/farm/socket_farm.h"
#include "master/metrics/metrics_server.h"
#include "master/progress/worker_wait.h"
#include "master/store/run_store.h"

namespace gapfarm {

// Keeps what a farm reports as lost or contradictory in the store, besides what `options` does with
// it.  Of the alarms only the first hundred: each costs a disk write, and a machine that computes
// wrongly raises one after the other.  `store` and `console` outlive the farm.
void keep_incidents(RunStore& store, Console& console, SocketFarmOptions& options);

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
  // Where generations and figures also go; neither is owned, both may be null.
  void watch(Log* log, MetricsServer* metrics);

 private:
  void refresh(double now_s);
  std::string words(const Pace& pace) const;
  void publish();

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
  std::optional<double> best_fitness_;
  Progress last_;
  Log* log_ = nullptr;
  MetricsServer* metrics_ = nullptr;
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
