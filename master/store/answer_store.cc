#include "master/store/answer_store.h"

#include "common/base/hash.h"
#include "common/problem/question.h"

namespace gapfarm {
namespace {

constexpr const char* kAnswerTables = R"sql(
CREATE TABLE IF NOT EXISTS problems (
  hash TEXT PRIMARY KEY,
  problem BLOB NOT NULL        -- gapfarm.v1.Problem
) STRICT;
CREATE TABLE IF NOT EXISTS answers (
  question TEXT PRIMARY KEY,   -- hash of build, problem and task
  number INTEGER NOT NULL,     -- in the order in which they were first asked
  problem_hash TEXT NOT NULL REFERENCES problems,
  fingerprint TEXT NOT NULL,   -- of the build
  stage TEXT NOT NULL,         -- of the experiment that asked first
  task BLOB NOT NULL,          -- gapfarm.v1.Task
  result BLOB NOT NULL         -- gapfarm.v1.TaskResult
) STRICT;
CREATE TABLE IF NOT EXISTS command (  -- one row: what the command last said about itself
  id INTEGER PRIMARY KEY CHECK (id = 1),
  record TEXT NOT NULL         -- JSON, as `gapfarm status --json` prints it
) STRICT;
)sql";

Status check_identity(const Database& database) {
  const auto id = database.integer("PRAGMA application_id", "read the answers");
  if (!id) return id.error();
  const auto tables = database.integer("SELECT count(*) FROM sqlite_master", "read the answers");
  if (!tables) return tables.error();
  if (*id == kAnswerStoreApplicationId || (*id == 0 && *tables == 0)) return {};
  return Error{database.file().string() + ": is a SQLite file of another kind (application id " +
               std::to_string(*id) + "); take another folder, or move the file away"};
}

}  // namespace

Result<AnswerStore> AnswerStore::open(const std::filesystem::path& file,
                                      const std::string& fingerprint) {
  std::error_code code;
  const bool there = std::filesystem::exists(file, code);
  auto database = Database::open(file, there ? Database::Mode::kWrite : Database::Mode::kCreate);
  if (!database) return database.error();
  if (Status s = check_identity(*database); !s) return s.error();
  const std::string tables =
      kAnswerTables + ("PRAGMA application_id = " + std::to_string(kAnswerStoreApplicationId));
  auto transaction = SqlTransaction::begin(*database);
  if (!transaction) return transaction.error();
  if (Status s = database->exec(tables, "keep answers"); !s) return s.error();
  if (Status s = transaction->commit(); !s) return s.error();
  const auto last =
      database->integer("SELECT coalesce(max(number), 0) FROM answers", "read the answers");
  if (!last) return last.error();
  AnswerStore store(std::move(*database), fingerprint);
  store.next_number_ = *last + 1;
  return store;
}

std::int64_t AnswerStore::reserve(std::size_t count) {
  const std::int64_t first = next_number_;
  next_number_ += static_cast<std::int64_t>(count);
  return first;
}

Status AnswerStore::add_problem(const std::string& hash, const std::string& bytes) {
  auto insert = database_.prepare("INSERT OR IGNORE INTO problems VALUES (?, ?)", "keep a problem");
  if (!insert) return insert.error();
  return insert->bind_text(1, hash).bind_blob(2, bytes).run();
}

std::string AnswerStore::key(const std::string& problem_hash, const v1::Task& task) const {
  return content_hash(fingerprint_ + '\n' + question_hash(problem_hash, task));
}

Result<std::optional<v1::TaskResult>> AnswerStore::find(const std::string& key) const {
  auto select = database_.prepare("SELECT result FROM answers WHERE question = ?", "read answers");
  if (!select) return select.error();
  const auto row = select->bind_text(1, key).step();
  if (!row) return row.error();
  std::optional<v1::TaskResult> result;
  if (*row && !result.emplace().ParseFromString(select->blob(0))) {
    return Error{database_.file().string() + ": the answer " + key +
                 " is damaged; delete the file and run the command again"};
  }
  return result;
}

Status AnswerStore::add(const std::string& problem_hash, const std::string& stage,
                        const std::vector<Answer>& answers) {
  auto transaction = SqlTransaction::begin(database_);
  if (!transaction) return transaction.error();
  auto insert = database_.prepare("INSERT OR IGNORE INTO answers VALUES (?, ?, ?, ?, ?, ?, ?)",
                                  "keep answers");
  if (!insert) return insert.error();
  for (const Answer& answer : answers) {
    insert->bind_text(1, answer.key).bind(2, answer.number).bind_text(3, problem_hash);
    insert->bind_text(4, fingerprint_).bind_text(5, stage);
    insert->bind_blob(6, answer.task->SerializeAsString());
    insert->bind_blob(7, answer.result->SerializeAsString());
    if (Status s = insert->run(); !s) return s;
  }
  return transaction->commit();
}

Result<std::int64_t> AnswerStore::count() const {
  return database_.integer("SELECT count(*) FROM answers", "count answers");
}

Status AnswerStore::forget() {
  return database_.exec("DELETE FROM answers; DELETE FROM problems; VACUUM", "forget the answers");
}

Status AnswerStore::set_command(const std::string& json) {
  auto insert =
      database_.prepare("INSERT OR REPLACE INTO command VALUES (1, ?)", "say how far it is");
  if (!insert) return insert.error();
  return insert->bind_text(1, json).run();
}

Result<std::optional<std::string>> read_command(const std::filesystem::path& file) {
  auto database = Database::open(file, Database::Mode::kQueryOnly);
  if (!database) return database.error();
  if (Status s = check_identity(*database); !s) return s.error();
  const auto there = database->integer("SELECT count(*) FROM sqlite_master WHERE name = 'command'",
                                       "read the command");
  if (!there) return there.error();
  std::optional<std::string> json;
  if (*there == 0) return json;  // of an older program
  auto select = database->prepare("SELECT record FROM command", "read the command");
  if (!select) return select.error();
  const auto row = select->step();
  if (!row) return row.error();
  if (*row) json = select->text(0);
  return json;
}

Result<std::vector<AnsweredStage>> read_stages(const std::filesystem::path& file) {
  auto database = Database::open(file, Database::Mode::kQueryOnly);
  if (!database) return database.error();
  if (Status s = check_identity(*database); !s) return s.error();
  auto select = database->prepare(
      "SELECT stage, count(*) FROM answers GROUP BY stage ORDER BY min(number)", "read the stages");
  if (!select) return select.error();
  std::vector<AnsweredStage> stages;
  for (;;) {
    const auto row = select->step();
    if (!row) return row.error();
    if (!*row) return stages;
    stages.push_back({select->text(0), select->integer(1)});
  }
}

}  // namespace gapfarm
