// Thin ownership over SQLite: a connection, its statements and its transactions.  Every error names
// the file, what was being done, SQLite's own words and what the user can do about it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace gapfarm {

// A prepared statement.  May not outlive its Database.  Parameters count from 1, columns from 0.
class SqlStatement {
 public:
  SqlStatement(SqlStatement&&) noexcept;
  SqlStatement& operator=(SqlStatement&&) noexcept;
  ~SqlStatement();

  SqlStatement& bind(int index, std::int64_t value);
  SqlStatement& bind(int index, double value);  // NaN becomes NULL
  SqlStatement& bind(int index, std::optional<double> value);
  SqlStatement& bind_text(int index, std::string_view value);
  SqlStatement& bind_blob(int index, std::string_view value);

  // True when a row is there to be read, false at the end.  Errors include those of bind().
  Result<bool> step();
  // Runs a statement that gives no rows, and makes it ready to be bound again.
  Status run();

  std::int64_t integer(int column) const;
  double real(int column) const;
  std::optional<double> optional_real(int column) const;
  std::string text(int column) const;
  std::string blob(int column) const;

 private:
  friend class Database;
  SqlStatement(sqlite3_stmt* statement, std::string file, std::string operation);

  sqlite3_stmt* statement_ = nullptr;
  std::string file_;
  std::string operation_;
  int bind_result_ = 0;
};

// For how long connections that this process opens from now on wait for a file that another holds;
// a minute unless told otherwise.  For who would keep others waiting meanwhile.
void set_database_patience_ms(int patience_ms);

class Database {
 public:
  enum class Mode {
    kCreate,     // an empty or absent file
    kWrite,      // an existing file
    kQueryOnly,  // an existing file, possibly in a folder that cannot be written
  };

  // Opens without reading: damage shows at the first statement.
  static Result<Database> open(const std::filesystem::path& file, Mode mode);

  Database(Database&&) noexcept;
  Database& operator=(Database&&) noexcept;
  ~Database();

  // Runs statements that give no rows.  `operation` completes "cannot ...".
  Status exec(const std::string& sql, const std::string& operation);
  Result<SqlStatement> prepare(const std::string& sql, const std::string& operation) const;
  // The only value of a statement's only row.
  Result<std::int64_t> integer(const std::string& sql, const std::string& operation) const;

  const std::filesystem::path& file() const { return file_; }

 private:
  Database(sqlite3* handle, std::filesystem::path file) : handle_(handle), file_(std::move(file)) {}

  sqlite3* handle_ = nullptr;
  std::filesystem::path file_;
};

// Everything until commit(), or nothing.
class SqlTransaction {
 public:
  // Takes the write lock at once, so that a busy file is met before work is done.
  static Result<SqlTransaction> begin(Database& database);
  SqlTransaction(SqlTransaction&& other) noexcept : database_(other.database_) {
    other.database_ = nullptr;
  }
  SqlTransaction& operator=(SqlTransaction&&) = delete;
  ~SqlTransaction();

  Status commit();

 private:
  explicit SqlTransaction(Database& database) : database_(&database) {}

  Database* database_;
};

}  // namespace gapfarm
