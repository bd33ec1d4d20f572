// Thin ownership over SQLite: a connection, its statements and its transactions.  Every error names
// the file, what was being done, SQLite's own words and what the user can do about it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/base/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace gapfarm {

struct SqlClose {
  void operator()(sqlite3* handle) const;
  void operator()(sqlite3_stmt* statement) const;
};

// Bytes that are no text, to be bound.
struct SqlBlob {
  std::string_view bytes;
};

// A prepared statement.  May not outlive its Database.  Parameters count from 1, columns from 0.
class SqlStatement {
 public:
  SqlStatement& bind(int index, std::int64_t value);
  SqlStatement& bind(int index, double value);  // NaN becomes NULL
  SqlStatement& bind(int index, std::optional<double> value);
  SqlStatement& bind(int index, std::string_view value);
  SqlStatement& bind(int index, SqlBlob value);
  template <class Whole>
  requires std::is_integral_v<Whole> SqlStatement& bind(int index, Whole value) {
    return bind(index, static_cast<std::int64_t>(value));
  }
  template <class Whole>
  requires std::is_integral_v<Whole> SqlStatement& bind(int index, std::optional<Whole> value) {
    return value ? bind(index, *value) : bind(index, std::optional<double>());
  }
  SqlStatement& bind(int index, const char* value) { return bind(index, std::string_view(value)); }
  SqlStatement& bind(int index, const std::string& value) {
    return bind(index, std::string_view(value));
  }
  // The parameters in their order.
  template <class... Values>
  SqlStatement& bind_all(const Values&... values) {
    int index = 0;
    (bind(++index, values), ...);
    return *this;
  }

  // True when a row is there to be read, false at the end.  Errors include those of bind().
  Result<bool> step();
  // Runs a statement that gives no rows, and makes it ready to be bound again.
  Status run();

  std::int64_t integer(int column) const;
  std::string text(int column) const;  // or the bytes of a blob, as they are
  // The row's columns in their order, from `first` on.
  template <class... Targets>
  void read_from(int first, Targets&&... to) const {
    (read(first++, to), ...);
  }
  template <class... Targets>
  void read_all(Targets&&... to) const {
    read_from(0, to...);
  }

 private:
  void read(int column, double& to) const;
  void read(int column, std::optional<double>& to) const;
  void read(int column, std::string& to) const { to = text(column); }
  template <class Whole>
  requires std::is_integral_v<Whole>
  void read(int column, Whole& to) const { to = static_cast<Whole>(integer(column)); }

  friend class Database;
  SqlStatement(sqlite3_stmt* statement, std::string file, std::string operation);

  std::unique_ptr<sqlite3_stmt, SqlClose> statement_;
  std::string file_;
  std::string operation_;
  int bind_result_ = 0;
};

// For how long connections that this process opens from now on wait for a file that another holds;
// a minute unless configured otherwise.  For who would keep others waiting meanwhile.
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

  // Runs statements that give no rows.  `operation` completes "cannot ...".
  Status exec(const std::string& sql, const std::string& operation);
  Result<SqlStatement> prepare(const std::string& sql, const std::string& operation) const;
  // Runs one statement that gives no rows, with these values.
  template <class... Values>
  Status run(const std::string& operation, const std::string& sql, const Values&... values) {
    Result<SqlStatement> statement = prepare(sql, operation);
    return statement ? statement->bind_all(values...).run() : Status(statement.error());
  }
  // What `read` makes of each row of a statement with these values.
  template <class Read, class... Values>
  auto rows(const std::string& operation, const std::string& sql, const Read& read,
            const Values&... values) const
      -> Result<std::vector<std::invoke_result_t<Read, const SqlStatement&>>> {
    Result<SqlStatement> statement = prepare(sql, operation);
    if (!statement) return statement.error();
    statement->bind_all(values...);
    std::vector<std::invoke_result_t<Read, const SqlStatement&>> all;
    for (;;) {
      ASSIGN_OR_RETURN(const auto row, statement->step());
      if (!row) return all;
      all.push_back(read(*statement));
    }
  }
  // The same of the first row, if there is one.
  template <class Read, class... Values>
  auto row(const std::string& operation, const std::string& sql, const Read& read,
           const Values&... values) const
      -> Result<std::optional<std::invoke_result_t<Read, const SqlStatement&>>> {
    using Row = std::optional<std::invoke_result_t<Read, const SqlStatement&>>;
    Result<SqlStatement> statement = prepare(sql, operation);
    if (!statement) return statement.error();
    ASSIGN_OR_RETURN(const auto there, statement->bind_all(values...).step());
    return there ? Row(read(*statement)) : Row();
  }
  // What kind of file it is: its application's id, and whether anything is in it.
  struct Identity {
    std::int64_t application = 0;
    bool empty = false;  // neither an id nor a table
  };
  Result<Identity> identity(const std::string& operation) const;
  // The only value of a statement's only row.
  Result<std::int64_t> integer(const std::string& sql, const std::string& operation) const;

  const std::filesystem::path& file() const { return file_; }

 private:
  Database(sqlite3* handle, std::filesystem::path file) : handle_(handle), file_(std::move(file)) {}

  std::unique_ptr<sqlite3, SqlClose> handle_;
  std::filesystem::path file_;
};

// Everything until commit(), or nothing.
class SqlTransaction {
 public:
  // Takes the write lock at once, so that a busy file is met before work is done.
  static Result<SqlTransaction> begin(Database& database);
  Status commit();

 private:
  explicit SqlTransaction(Database& database) : database_(&database) {}

  struct RollBack {
    void operator()(Database* database) const;
  };

  std::unique_ptr<Database, RollBack> database_;
};

}  // namespace gapfarm
