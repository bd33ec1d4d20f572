#include "master/store/database.h"

#include <gmock/gmock.h>

#include <cmath>
#include <fstream>

#include "tests/unit/store/store_fixture.h"

namespace gapfarm::database_test {

using ::testing::HasSubstr;

class DatabaseTest : public StoreTest {
 protected:
  Database open_table() {
    Result<Database> database = Database::open(folder_ / "t.sqlite", Database::Mode::kCreate);
    EXPECT_TRUE(database->exec("CREATE TABLE t (a, b)", "make a table").ok());
    return std::move(*database);
  }
};

TEST_F(DatabaseTest, ReturnsBytesAndNumbersAsTheyWere) {
  Database database = open_table();
  Result<SqlStatement> insert = database.prepare("INSERT INTO t VALUES (?, ?)", "insert");
  ASSERT_TRUE(insert.ok());
  const std::string bytes("\0a\xff", 3);
  ASSERT_TRUE(insert->bind(1, SqlBlob{bytes}).bind(2, 0.1).run().ok());
  ASSERT_TRUE(insert->bind(1, "").bind(2, std::nan("")).run().ok());

  const auto rows = database.rows("select", "SELECT a, b FROM t", [](const SqlStatement& row) {
    std::pair<std::string, std::optional<double>> read;
    row.read_all(read.first, read.second);
    return read;
  });
  ASSERT_TRUE(rows.ok());
  ASSERT_EQ(rows->size(), 2u);
  EXPECT_EQ(rows->front().first, bytes);
  EXPECT_EQ(rows->front().second, 0.1);
  EXPECT_EQ(rows->back().first, "");
  EXPECT_FALSE(rows->back().second.has_value());
}

TEST_F(DatabaseTest, ForgetsATransactionThatWasNotCommitted) {
  Database database = open_table();
  {
    Result<SqlTransaction> transaction = SqlTransaction::begin(database);
    ASSERT_TRUE(transaction.ok());
    ASSERT_TRUE(database.exec("INSERT INTO t VALUES (1, 2)", "insert").ok());
  }
  EXPECT_EQ(*database.integer("SELECT count(*) FROM t", "count"), 0);
}

TEST_F(DatabaseTest, NamesFileOperationAndReason) {
  Database database = open_table();
  const Status failed = database.exec("INSERT INTO nowhere VALUES (1)", "commit generation 3");
  ASSERT_FALSE(failed.ok());
  EXPECT_THAT(failed.error().message, HasSubstr("t.sqlite: cannot commit generation 3: no such "
                                                "table: nowhere; "));
}

TEST_F(DatabaseTest, ReportsAWrongNumberOfValues) {
  Database database = open_table();
  Result<SqlStatement> insert = database.prepare("INSERT INTO t VALUES (?, ?)", "insert");
  insert->bind(3, 1.0);
  EXPECT_FALSE(insert->run().ok());
}

TEST_F(DatabaseTest, ChangesNothingThroughAQueryOnlyConnection) {
  open_table();
  Result<Database> reader = Database::open(folder_ / "t.sqlite", Database::Mode::kQueryOnly);
  ASSERT_TRUE(reader.ok());
  EXPECT_FALSE(reader->exec("INSERT INTO t VALUES (1, 2)", "insert").ok());
  EXPECT_FALSE(Database::open(folder_ / "absent.sqlite", Database::Mode::kQueryOnly).ok());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "absent.sqlite"));
}

}  // namespace gapfarm::database_test
