#include <sqlite3.h>

#include <map>
#include <memory>

#include "common/base/ranges.h"
#include "common/trials/text/csv.h"
#include "master/io/logs/bags.h"
#include "master/io/logs/topics.h"

namespace gapfarm {
namespace {

struct Close {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Database = std::unique_ptr<sqlite3, Close>;
using Statement = std::unique_ptr<sqlite3_stmt, Close>;

std::string text_of(sqlite3_stmt* row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return text == nullptr ? "" : text;
}

class Db3Bag {
 public:
  explicit Db3Bag(const std::string& path) : path_(path), topics_(path, "a rosbag2 SQLite file") {}

  Result<Recording> run() {
    sqlite3* raw = nullptr;
    const int code = sqlite3_open_v2(path_.c_str(), &raw, SQLITE_OPEN_READONLY, nullptr);
    database_.reset(raw);
    if (code != SQLITE_OK) return broken();
    RETURN_IF_ERROR(read_topics());
    RETURN_IF_ERROR(read_messages());
    return topics_.finish();
  }

 private:
  Error broken() const {
    return Error{path_ + ":1: found a SQLite file that rosbag2 did not write or that is damaged (" +
                 sqlite3_errmsg(database_.get()) +
                 "), expected its tables topics and messages; give the .db3 of the bag's folder"};
  }

  Result<Statement> prepare(const char* sql) {
    sqlite3_stmt* raw = nullptr;
    if (sqlite3_prepare_v2(database_.get(), sql, -1, &raw, nullptr) != SQLITE_OK) return broken();
    return Statement(raw);
  }

  Status read_topics() {
    ASSIGN_OR_RETURN(auto rows, prepare("SELECT id, name, type, serialization_format FROM topics"));
    int code = SQLITE_ROW;
    while ((code = sqlite3_step(rows.get())) == SQLITE_ROW) {
      BagTopic topic{text_of(rows.get(), 1), text_of(rows.get(), 2)};
      if (serves_ground_robots(topic.type) && text_of(rows.get(), 3) == "cdr") {
        // Another package's type of the same name is left.
        Result<MessageSchema> schema = MessageSchema::known(topic.type);
        if (schema) topic.schema = *std::move(schema);
      }
      by_id_.emplace(sqlite3_column_int64(rows.get(), 0), std::move(topic));
    }
    if (code != SQLITE_DONE) return broken();
    return {};
  }

  Status read_messages() {
    ASSIGN_OR_RETURN(
        auto rows,
        prepare("SELECT topic_id, timestamp, data, id FROM messages ORDER BY timestamp, id"));
    int code = SQLITE_ROW;
    while ((code = sqlite3_step(rows.get())) == SQLITE_ROW) {
      BagTopic* topic = find_in(by_id_, sqlite3_column_int64(rows.get(), 0));
      if (!topic) return broken();
      const double t = seconds_of(static_cast<std::uint64_t>(sqlite3_column_int64(rows.get(), 1)));
      const auto* data = static_cast<const char*>(sqlite3_column_blob(rows.get(), 2));
      const auto size = static_cast<std::size_t>(sqlite3_column_bytes(rows.get(), 2));
      const std::string_view bytes(data == nullptr ? "" : data, data == nullptr ? 0 : size);
      RETURN_IF_ERROR(
          under(path_ + ":1: message " + text_of(rows.get(), 3), topics_.add(*topic, t, bytes)));
    }
    if (code != SQLITE_DONE) return broken();
    return {};
  }

  const std::string& path_;
  Topics topics_;
  Database database_;
  std::map<sqlite3_int64, BagTopic> by_id_;
};

}  // namespace

Result<Recording> read_db3(ByteSource&, const std::string& path) { return Db3Bag(path).run(); }

}  // namespace gapfarm
