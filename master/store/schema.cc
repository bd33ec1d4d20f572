#include "master/store/schema.h"

#include <charconv>
#include <iterator>
#include <system_error>

#include "common/base/try.h"

namespace gapfarm {
namespace {

// Schema 1.  Comments inside the statements stay in the file and show in `.schema`.
constexpr const char* kTables = R"sql(
CREATE TABLE run (             -- one row: what was fixed when the run was created
  id INTEGER PRIMARY KEY CHECK (id = 1),
  program_version TEXT NOT NULL,
  fingerprint TEXT NOT NULL,   -- of the build
  created TEXT NOT NULL,       -- UTC
  config_path TEXT NOT NULL,
  config TEXT NOT NULL,        -- the file's text
  overrides TEXT NOT NULL,     -- JSON, command-line options
  problem BLOB NOT NULL,       -- gapfarm.v1.Problem
  problem_hash TEXT NOT NULL,
  seed TEXT NOT NULL,          -- unsigned 64 bits, decimal
  numeric_class TEXT NOT NULL,
  fitness TEXT NOT NULL,
  fitness_unit TEXT NOT NULL,
  higher_is_better INTEGER NOT NULL
) STRICT;
CREATE TABLE generations (
  generation INTEGER PRIMARY KEY,
  best REAL, mean REAL, median REAL, worst REAL,  -- fitness over the OK individuals
  diversity REAL NOT NULL,
  operator_probabilities TEXT NOT NULL,           -- JSON object
  evaluations INTEGER NOT NULL,                   -- since the run began
  wall_s REAL NOT NULL,                           -- of this generation
  quarantined INTEGER NOT NULL,
  optimiser_state BLOB NOT NULL,                  -- after this generation
  digest TEXT NOT NULL                            -- over this and all earlier generations
) STRICT;
CREATE TABLE individuals (
  generation INTEGER NOT NULL REFERENCES generations ON DELETE CASCADE,
  rank INTEGER NOT NULL,       -- 0: best
  birth_id INTEGER NOT NULL,
  genome BLOB NOT NULL,        -- doubles in [0, 1], the machine's byte order
  parameters TEXT NOT NULL,    -- JSON object: parameter to value
  outcome TEXT NOT NULL,
  fitness REAL,                -- NULL unless the outcome is OK
  scores INTEGER NOT NULL,     -- evaluations behind the fitness
  parents TEXT NOT NULL,       -- JSON array of birth ids
  operators TEXT NOT NULL,
  PRIMARY KEY (generation, rank)
) STRICT;
CREATE INDEX individuals_by_birth ON individuals (birth_id);
CREATE TABLE progress (        -- one row: what the master last said about itself
  id INTEGER PRIMARY KEY CHECK (id = 1),
  state TEXT NOT NULL,
  stop_reason TEXT NOT NULL,   -- while it runs: what it waits for
  pid INTEGER NOT NULL,
  host TEXT NOT NULL,
  heartbeat REAL NOT NULL,     -- Unix time
  rate_per_s REAL NOT NULL,
  time_left_s REAL,
  done INTEGER NOT NULL,       -- tasks of the generation in work
  total INTEGER NOT NULL,
  workers TEXT NOT NULL,       -- JSON array
  epoch INTEGER NOT NULL       -- masters that have written to this run
) STRICT;
)sql";

// From schema i + 1 to i + 2.  New files go the same way, so there is one way to each schema.
constexpr const char* kUpgrades[] = {
    R"sql(
ALTER TABLE progress ADD COLUMN
  farm TEXT NOT NULL DEFAULT '{}' /* JSON object: counts over all masters of this run */;
CREATE TABLE incidents (       -- what somebody should look at, as it happened
  generation INTEGER NOT NULL, -- in work then
  kind TEXT NOT NULL,          -- quarantine: a task was given up; alarm: two answers to one task
  time REAL NOT NULL,          -- Unix time
  text TEXT NOT NULL
) STRICT;
)sql",
    R"sql(
CREATE TABLE documents (       -- what was worked out once, so that a report needs no simulation
  name TEXT PRIMARY KEY,       -- "outcome": the log as the best predicts it (docs/run_store.md)
  generation INTEGER NOT NULL, -- it is of
  content TEXT NOT NULL        -- JSON
) STRICT;
)sql",
    R"sql(
CREATE TABLE worker_events (   -- who came and went, and why
  time REAL NOT NULL,          -- Unix time
  kind TEXT NOT NULL,          -- joined, returned, left, silent, died, refused; master, end (of one)
  worker TEXT NOT NULL,        -- its name; of a master: empty
  host TEXT NOT NULL,
  text TEXT NOT NULL
) STRICT;
)sql",
    R"sql(
ALTER TABLE individuals ADD COLUMN
  objectives TEXT NOT NULL DEFAULT '' /* JSON object, of several objectives; else empty */;
)sql",
};
static_assert(std::size(kUpgrades) + 1 == kRunStoreSchema);

Status upgrade_from(Database& database, std::int64_t schema, const std::string& operation) {
  for (std::int64_t from = schema; from < kRunStoreSchema; ++from) {
    RETURN_IF_ERROR(database.exec(kUpgrades[from - 1], operation));
  }
  return database.exec("PRAGMA user_version = " + std::to_string(kRunStoreSchema), operation);
}

}  // namespace

std::filesystem::path run_store_file(const std::filesystem::path& run) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(run, ignored) ? run : run / "run.sqlite";
}

Status create_run_tables(Database& database) {
  const std::string operation = "create the run store";
  RETURN_IF_ERROR(database.exec(kTables, operation));
  RETURN_IF_ERROR(database.exec("PRAGMA application_id = " + std::to_string(kRunStoreApplicationId),
                                operation));
  return upgrade_from(database, 1, operation);
}

Result<std::int64_t> run_store_schema(const Database& database) {
  return database.integer("PRAGMA user_version", "read the run store");
}

Status upgrade_run_store(Database& database) {
  ASSIGN_OR_RETURN(const std::int64_t schema, run_store_schema(database));
  if (schema >= kRunStoreSchema) return {};
  ASSIGN_OR_RETURN(SqlTransaction transaction, SqlTransaction::begin(database));
  RETURN_IF_ERROR(upgrade_from(database, schema, "upgrade the run store"));
  return transaction.commit();
}

Status check_run_store(const Database& database) {
  const std::string file = database.file().string();
  std::error_code ignored;
  if (std::filesystem::file_size(database.file(), ignored) == 0 && !ignored) {
    return Error{file + ": is empty: creating the run was interrupted; delete it and start again"};
  }
  ASSIGN_OR_RETURN(const std::int64_t tables,
                   database.integer("SELECT count(*) FROM sqlite_master", "read the run store"));
  ASSIGN_OR_RETURN(const std::int64_t id,
                   database.integer("PRAGMA application_id", "read the run store"));
  if (id == 0 && tables == 0) {
    return Error{file + ": has no tables: creating the run was interrupted; start it again"};
  }
  if (id != kRunStoreApplicationId) {
    return Error{file + ": is a SQLite file of another program (application id " +
                 std::to_string(id) + ", a run store has " +
                 std::to_string(kRunStoreApplicationId) + "); give the folder of a gapfarm run"};
  }
  ASSIGN_OR_RETURN(const std::int64_t schema, run_store_schema(database));
  if (schema < 1) {
    return Error{file + ": names no schema: the file was changed by hand; restore a copy"};
  }
  if (schema > kRunStoreSchema) {
    return Error{file + ": was written by a newer gapfarm (schema " + std::to_string(schema) +
                 "; this program knows up to " + std::to_string(kRunStoreSchema) +
                 "); use the newer program"};
  }
  return {};
}

Status insert_run_info(Database& database, const RunInfo& i) {
  return database.run("create the run store",
                      "INSERT INTO run VALUES (1, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                      i.program_version, i.fingerprint, i.created, i.config_path, i.config_text,
                      i.overrides, SqlBlob{i.problem}, i.problem_hash, std::to_string(i.seed),
                      i.numeric_class, i.fitness, i.fitness_unit, i.higher_is_better);
}

Result<RunInfo> load_run_info(const Database& database) {
  ASSIGN_OR_RETURN(
      auto info,
      database.row(
          "read the run store",
          "SELECT program_version, fingerprint, created, config_path, config, overrides, problem, "
          "problem_hash, seed, numeric_class, fitness, fitness_unit, higher_is_better FROM run",
          [](const SqlStatement& row) {
            RunInfo i;
            std::string seed;
            row.read_all(i.program_version, i.fingerprint, i.created, i.config_path, i.config_text,
                         i.overrides, SqlBlob{i.problem}, i.problem_hash, seed, i.numeric_class,
                         i.fitness, i.fitness_unit, i.higher_is_better);
            std::from_chars(seed.data(), seed.data() + seed.size(), i.seed);
            return i;
          }));
  if (info) return *std::move(info);
  return Error{database.file().string() +
               ": table run is empty: the file was changed by hand; restore a copy"};
}

}  // namespace gapfarm
