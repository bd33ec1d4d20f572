#include "master/store/database.h"

#include <sqlite3.h>

#include <atomic>
#include <cstring>

namespace gapfarm {
namespace {

// `gapfarm status` holds the file for milliseconds, but somebody may look around in it by hand.
std::atomic<int> busy_timeout_ms = 60000;

const char* remedy(int code) {
  switch (code & 0xff) {
    case SQLITE_NOTADB:
      return "it is not a SQLite file; give the folder of a gapfarm run";
    case SQLITE_CORRUPT:
      return "the file is damaged; restore a copy, or save what is left with `sqlite3 run.sqlite "
             ".recover`";
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "another program holds the file; close it and try again";
    case SQLITE_FULL:
      return "free some disk space; then the same command goes on, a run by `gapfarm resume`";
    case SQLITE_READONLY:
      return (code == SQLITE_READONLY_ROLLBACK || code == SQLITE_READONLY_RECOVERY)
                 ? "a crash left a half-written generation that must be rolled back: run the "
                   "command once where the run folder can be written"
                 : "make the run folder writable";
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_AUTH:
      return "check that the file exists and that you may read it and write its folder";
    case SQLITE_IOERR:
      return "check the disk or the network mount";
    default:
      return "check the file with `sqlite3 run.sqlite 'PRAGMA integrity_check'`";
  }
}

// `handle` may be null.
Error sql_error(const std::string& file, const std::string& operation, int code, const char* text,
                sqlite3* handle) {
  // What the operating system reported shows more than SQLite's "unable to open" or "disk I/O
  // error".
  const bool system = (code & 0xff) == SQLITE_CANTOPEN || (code & 0xff) == SQLITE_IOERR;
  const int number = system && handle != nullptr ? sqlite3_system_errno(handle) : 0;
  std::string detail = text;
  if (number != 0) detail += std::string(" (") + std::strerror(number) + ")";
  return Error{file + ": cannot " + operation + ": " + detail + "; " +
               remedy(number == ENOSPC || number == EDQUOT ? SQLITE_FULL : code)};
}

}  // namespace

void set_database_patience_ms(int patience_ms) { busy_timeout_ms = patience_ms; }

void SqlClose::operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }
void SqlClose::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

SqlStatement::SqlStatement(sqlite3_stmt* statement, std::string file, std::string operation)
    : statement_(statement), file_(std::move(file)), operation_(std::move(operation)) {}

SqlStatement& SqlStatement::bind(int index, std::int64_t value) {
  bind_result_ |= sqlite3_bind_int64(statement_.get(), index, value);
  return *this;
}

SqlStatement& SqlStatement::bind(int index, double value) {
  bind_result_ |= sqlite3_bind_double(statement_.get(), index, value);
  return *this;
}

SqlStatement& SqlStatement::bind(int index, std::optional<double> value) {
  bind_result_ |= value ? sqlite3_bind_double(statement_.get(), index, *value)
                        : sqlite3_bind_null(statement_.get(), index);
  return *this;
}

SqlStatement& SqlStatement::bind(int index, std::string_view value) {
  bind_result_ |= sqlite3_bind_text64(statement_.get(), index, value.data() ? value.data() : "",
                                      value.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  return *this;
}

SqlStatement& SqlStatement::bind(int index, SqlBlob value) {
  const std::string_view bytes = value.bytes;
  bind_result_ |= sqlite3_bind_blob64(statement_.get(), index, bytes.data() ? bytes.data() : "",
                                      bytes.size(), SQLITE_TRANSIENT);
  return *this;
}

Result<bool> SqlStatement::step() {
  sqlite3* handle = sqlite3_db_handle(statement_.get());
  if (bind_result_ != SQLITE_OK) {
    return sql_error(file_, operation_, bind_result_, "a value could not be bound", handle);
  }
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  Error error = sql_error(file_, operation_, sqlite3_extended_errcode(handle),
                          sqlite3_errmsg(handle), handle);
  sqlite3_reset(statement_.get());
  return error;
}

Status SqlStatement::run() {
  RETURN_IF_ERROR(step());
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
  return {};
}

std::int64_t SqlStatement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

void SqlStatement::read(int column, double& to) const {
  to = sqlite3_column_double(statement_.get(), column);
}

void SqlStatement::read(int column, std::optional<double>& to) const {
  to.reset();
  if (sqlite3_column_type(statement_.get(), column) != SQLITE_NULL) read(column, to.emplace());
}

std::string SqlStatement::text(int column) const {
  const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  if (!bytes) return {};
  return {bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

Result<Database> Database::open(const std::filesystem::path& file, Mode mode) {
  // Query-only connections are opened for writing too where that is possible, since only such a one
  // can roll back what a crashed master left half-written.  SQLite falls back to read-only.
  int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX;
  if (mode == Mode::kCreate) flags |= SQLITE_OPEN_CREATE;
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(file.c_str(), &handle, flags, nullptr);
  Database database(handle, file);
  if (code != SQLITE_OK) {
    return sql_error(file.string(), "open the run store", code,
                     handle ? sqlite3_errmsg(handle) : sqlite3_errstr(code), handle);
  }
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, busy_timeout_ms);
  if (mode == Mode::kQueryOnly) {
    RETURN_IF_ERROR(database.exec("PRAGMA query_only = ON", "open the run store"));
    return database;
  }
  RETURN_IF_ERROR(database.exec(
      "PRAGMA journal_mode = DELETE; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON",
      "open the run store"));
  return database;
}

Status Database::exec(const std::string& sql, const std::string& operation) {
  if (sqlite3_exec(handle_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
    return sql_error(file_.string(), operation, sqlite3_extended_errcode(handle_.get()),
                     sqlite3_errmsg(handle_.get()), handle_.get());
  }
  return {};
}

Result<SqlStatement> Database::prepare(const std::string& sql, const std::string& operation) const {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(handle_.get(), sql.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
    return sql_error(file_.string(), operation, sqlite3_extended_errcode(handle_.get()),
                     sqlite3_errmsg(handle_.get()), handle_.get());
  }
  return SqlStatement(statement, file_.string(), operation);
}

Result<std::int64_t> Database::integer(const std::string& sql, const std::string& operation) const {
  ASSIGN_OR_RETURN(const auto found,
                   row(operation, sql, [](const SqlStatement& row) { return row.integer(0); }));
  return found.value_or(0);
}

Result<Database::Identity> Database::identity(const std::string& operation) const {
  ASSIGN_OR_RETURN(const auto id, integer("PRAGMA application_id", operation));
  ASSIGN_OR_RETURN(const auto tables, integer("SELECT count(*) FROM sqlite_master", operation));
  return Identity{id, id == 0 && tables == 0};
}

Result<SqlTransaction> SqlTransaction::begin(Database& database) {
  RETURN_IF_ERROR(database.exec("BEGIN IMMEDIATE", "begin a transaction"));
  return SqlTransaction(database);
}

Status SqlTransaction::commit() {
  RETURN_IF_ERROR(database_->exec("COMMIT", "commit"));
  static_cast<void>(database_.release());
  return {};
}

void SqlTransaction::RollBack::operator()(Database* database) const {
  // Nothing can be done about an error here: the next open rolls back as well.
  static_cast<void>(database->exec("ROLLBACK", "roll back"));
}

}  // namespace gapfarm
