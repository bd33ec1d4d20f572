// What `gapfarm status` says of a run.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/store/records.h"
#include "master/store/run_reader.h"

namespace gapfarm {

struct RunStatus {
  RunState state = RunState::kStopped;
  std::string stop_reason;        // "" while running; "crashed: ..." when the master just went
  std::uint64_t generation = 0;   // last committed; 0: none
  std::uint64_t evaluations = 0;  // committed
  double wall_s = 0;              // spent on committed generations
  std::optional<double> best, mean, worst;  // fitness of the last committed generation
  double rate_per_s = 0;
  std::optional<double> time_left_s;
  std::string digest;               // empty: nothing committed
  std::uint64_t quarantined = 0;    // tasks given up, with those of the generation in work
  std::vector<Incident> incidents;  // in the order in which they happened
  Progress progress;
  double heartbeat_age_s = 0;
  std::vector<std::optional<double>> best_by_generation;
  std::optional<StoredIndividual> best_individual;
  RunInfo info;
};

// "running" needs a master that holds the run's lock or, where this machine cannot see the lock
// (another host, a mount without locks), a heartbeat younger than 30 s.  `now_unix_s`: the clock.
Result<RunStatus> run_status(const RunReader& reader, double now_unix_s);

// docs/formats.md, "Status".
nlohmann::ordered_json workers_json(const std::vector<StoredWorker>& workers);
// What was written by hand or damaged reads as empty.
std::vector<StoredWorker> workers_of(const nlohmann::ordered_json& json);
nlohmann::ordered_json fleets_json(const std::vector<FleetStatus>& fleets);
std::vector<FleetStatus> fleets_of(const nlohmann::ordered_json& json);
nlohmann::ordered_json to_json(const RunStatus& status);

}  // namespace gapfarm
