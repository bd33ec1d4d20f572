// The run store: one SQLite file a run, `RUN/run.sqlite`.  The writing side; see run_reader.h for
// the reading one and docs/run_store.md for the tables.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "master/store/database.h"
#include "master/store/records.h"
#include "master/store/run_lock.h"

namespace gapfarm {

// Where a run continues.
struct Checkpoint {
  std::uint64_t generation = 0;
  std::uint64_t evaluations = 0;  // since the run began
  double wall_s = 0;              // spent so far
  std::string optimiser_state;
  std::string digest;
};

class RunStore {
 public:
  // Makes folder `run` (and its parents) with a store in it, and locks it.  Errors: the folder
  // holds a run already, is in use, or cannot be written.
  static Result<RunStore> create(const std::filesystem::path& run, const RunInfo& info);

  // Error: the folder holds a run already.
  static Status check_free(const std::filesystem::path& run);

  // Takes away a run that never had a generation, and its folder too when asked and empty.
  static Status discard(RunStore store, bool with_folder);

  // Opens and locks an existing run, checks the file for damage, and says that it runs again.
  static Result<RunStore> open(const std::filesystem::path& run);

  const RunInfo& info() const { return info_; }
  const std::filesystem::path& run() const { return run_; }
  std::uint64_t epoch() const { return epoch_; }

  // The numeric class that the first worker brought.  Once set it stays, until another build goes
  // on with the run, whose numbers are its own: then the run is of that build.
  Status set_numeric_class(const std::string& numeric_class);

  // What the command line gives the run from now on (RunInfo::overrides).
  Status set_overrides(const std::string& json);

  // Commits a generation with all its individuals and the state after it in one transaction, on
  // disk when it returns.  Generations follow one another without gaps.  Returns the run's digest.
  Result<std::string> commit(const StoredGeneration& generation);

  // Overwrites the live row and its heartbeat.  `progress.farm` counts this master's part; what
  // those before it counted is added.  Costs a disk write: about once a second is enough.
  Status set_progress(const Progress& progress);

  // Keeps what happened in the generation in work.  Quarantines of a generation that is not
  // committed are forgotten when the run is opened again: it is evaluated again.
  Status add_incident(IncidentKind kind, const std::string& text);

  // Keeps who came and went, in one transaction.
  Status add_worker_events(const std::vector<StoredWorkerEvent>& events);

  // Keeps a JSON text under `name`, of the last generation, in place of what was there.
  Status keep_document(const std::string& name, const std::string& json);

  // Tasks given up in all committed generations, by this master or those before it.
  Result<std::uint64_t> quarantined() const;

  // The state after `generation`, or after the last one; none when nothing was committed yet.
  // Errors: there is no such generation.
  Result<std::optional<Checkpoint>> checkpoint(std::optional<std::uint64_t> generation = {}) const;

  // Forgets every generation after `generation`, once the file as it was is safely copied to
  // `RUN/run.generation-LAST.sqlite`, whose path it returns (empty: there was nothing to forget).
  Result<std::filesystem::path> truncate_after(std::uint64_t generation);

 private:
  RunStore(std::filesystem::path run, RunLock lock, Database database)
      : run_(std::move(run)), lock_(std::move(lock)), database_(std::move(database)) {}

  Status insert_worker_events(const std::vector<StoredWorkerEvent>& events);
  Status insert_individuals(const StoredGeneration& generation);
  Status load_before();
  Status begin_epoch();
  std::uint64_t next_generation() const { return last_generation_.value_or(0) + 1; }

  std::filesystem::path run_;
  RunLock lock_;
  Database database_;
  RunInfo info_;
  std::uint64_t epoch_ = 0;
  FarmTally farm_before_;         // of earlier masters
  StoredWorkerEvent end_before_;  // of the master before
  std::optional<std::uint64_t> last_generation_;
  std::string digest_;
};

}  // namespace gapfarm
