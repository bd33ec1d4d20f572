// The tables of a run store and the checks that a file is one.
#pragma once

#include <cstdint>
#include <filesystem>

#include "common/base/result.h"
#include "master/store/database.h"
#include "master/store/records.h"

namespace gapfarm {

inline constexpr std::int64_t kRunStoreApplicationId = 0x67617066;  // "gapf"
inline constexpr std::int64_t kRunStoreSchema = 5;

// `RUN/run.sqlite` of a run folder; a regular file is taken as the store itself.
std::filesystem::path run_store_file(const std::filesystem::path& run);

// REQUIRES: an open transaction on an empty file.
Status create_run_tables(Database& database);

// OK when `database` is a run store that this program can read.
Status check_run_store(const Database& database);

// Brings a store that an older program made to this program's schema, in one transaction; one that
// is there already is left alone.  REQUIRES: check_run_store() and no open transaction.
Status upgrade_run_store(Database& database);

// Of the file.  Older ones than kRunStoreSchema lack tables and columns.
Result<std::int64_t> run_store_schema(const Database& database);

Status insert_run_info(Database& database, const RunInfo& info);
Result<RunInfo> load_run_info(const Database& database);

}  // namespace gapfarm
