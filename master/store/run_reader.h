// Reads a run, live or dead, without ever getting in its master's way.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/json/json.h"
#include "master/store/database.h"
#include "master/store/records.h"

namespace gapfarm {

class RunReader {
 public:
  // `run` is a run folder or a store file (one that truncate_after() kept, say).  Works on a
  // read-only folder.  Errors: nothing there, not a run store, damaged, written by a newer program.
  static Result<RunReader> open(const std::filesystem::path& run);

  const RunInfo& info() const { return info_; }
  const std::filesystem::path& run() const { return run_; }

  // Every generation in order, without individuals and optimiser states.
  Result<std::vector<StoredGeneration>> generations() const;
  // After a generation; empty when there is no such generation.
  Result<std::string> optimiser_state(std::uint64_t generation) const;
  // Best first; empty when there is no such generation.
  Result<std::vector<StoredIndividual>> individuals(std::uint64_t generation) const;
  // The best of the last generation; none when nothing was committed yet, or nothing ended well.
  Result<std::optional<StoredIndividual>> best() const;
  // In the order in which they happened.
  Result<std::vector<Incident>> incidents() const;
  // Likewise; at most the latest `most`.
  Result<std::vector<StoredWorkerEvent>> worker_events(std::size_t most) const;
  // Of whatever generation it was a member of first; none when nobody has that birth id.
  struct Member {
    std::uint64_t generation = 0;
    StoredIndividual individual;
  };
  Result<std::optional<Member>> member(std::uint64_t birth_id) const;
  // Members whose tasks were given up, latest first, at most `most`.
  Result<std::vector<Member>> given_up(std::size_t most) const;
  // What RunStore::keep_document() kept under `name`; none when there is no such text.
  Result<std::optional<StoredDocument>> document(const std::string& name) const;
  // As the master last wrote it.  What it says of a master that crashed is stale: run_status().
  Result<Progress> progress() const;

 private:
  std::string member_columns() const;

  RunReader(std::filesystem::path run, Database database)
      : run_(std::move(run)), database_(std::move(database)) {}

  Result<std::vector<Member>> members(const std::string& where, std::int64_t bound) const;

  std::filesystem::path run_;
  Database database_;
  std::int64_t schema_ = 0;
  RunInfo info_;
};

// What a search of several objectives found: the members of the last generation that no other
// beats. Numbers are in the objectives' own senses.
struct RunFront {
  std::vector<SearchedObjective> objectives;  // empty: the run has one fitness
  std::vector<StoredIndividual> members;      // in the order of the first objective
  std::size_t knee = 0;                       // of them: the run's best
  std::vector<double> ideal, nadir;           // best and worst on the front; empty without members
  // Worst of each objective in the first generation of which anything ended well: the hypervolume
  // is measured from there.
  std::vector<double> reference;
  std::vector<std::optional<double>> hypervolume;  // by generation

  // Lower is better.  REQUIRES: `member` has objectives.
  std::vector<double> costs(const StoredIndividual& member) const;
};
Result<RunFront> run_front(const RunReader& reader,
                           const std::vector<StoredGeneration>& generations);
// A member's parameters; null where they were damaged.
Json values_json(const StoredIndividual& member);
Json to_json(const RunFront& front);

// Of a run that is over, the rate is that of all it did.
struct RunStatus : Progress {
  StoredGeneration last;            // committed, without its members; number 0: none
  double wall_s = 0;                // spent on committed generations
  std::uint64_t quarantined = 0;    // tasks given up, with those of the generation in work
  std::vector<Incident> incidents;  // in the order in which they happened
  double heartbeat_age_s = 0;
  std::vector<std::optional<double>> best_by_generation;
  std::optional<StoredIndividual> best_individual;
  RunFront front;  // of several objectives
  RunInfo info;
};

// "running" needs a master that holds the run's lock or, where this machine cannot see the lock
// (another host, a mount without locks), a heartbeat younger than 30 s.  `now_unix_s`: the clock.
Result<RunStatus> run_status(const RunReader& reader, double now_unix_s);

// Where the search began, if not at the config's own values, as the run keeps it; else null.
nlohmann::ordered_json search_start(const RunInfo& info);
// "run/a after generation 12: friction fixed at 0.4"; empty: at the config's own values.
std::string search_start_text(const RunInfo& info);

// docs/formats.md, "Status".
Json workers_json(const std::vector<WorkerStatus>& workers);
// What was written by hand or damaged reads as empty.
std::vector<WorkerStatus> workers_of(const Json& json);
Json fleets_json(const std::vector<FleetStatus>& fleets);
std::vector<FleetStatus> fleets_of(const Json& json);
Json to_json(const FarmTally& tally);
Json to_json(const RunStatus& status);

}  // namespace gapfarm
