#include "master/store/schema.h"

#include <charconv>
#include <iterator>
#include <system_error>

#include "master/store/tables.h"

namespace gapfarm {
namespace {

// From schema i + 1 to i + 2.  New files go the same way, so there is one way to each schema.
constexpr const char* kUpgrades[] = {kToSchema2, kToSchema3, kToSchema4, kToSchema5};
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
  RETURN_IF_ERROR(database.exec(kSchema1, operation));
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
  ASSIGN_OR_RETURN(const auto is, database.identity("read the run store"));
  if (is.empty) {
    return Error{file + ": has no tables: creating the run was interrupted; start it again"};
  }
  if (is.application != kRunStoreApplicationId) {
    return Error{file + ": is a SQLite file of another program (application id " +
                 std::to_string(is.application) + ", a run store has " +
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
                         i.overrides, i.problem, i.problem_hash, seed, i.numeric_class, i.fitness,
                         i.fitness_unit, i.higher_is_better);
            std::from_chars(seed.data(), seed.data() + seed.size(), i.seed);
            return i;
          }));
  if (info) return *std::move(info);
  return Error{database.file().string() +
               ": table run is empty: the file was changed by hand; restore a copy"};
}

}  // namespace gapfarm
