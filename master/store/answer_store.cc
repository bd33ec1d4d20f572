#include "master/store/answer_store.h"

#include <utility>

#include "common/base/hash.h"
#include "common/problem/problem.h"
#include "master/store/tables.h"

namespace gapfarm {
namespace {

std::string first_blob(const SqlStatement& row) {
  std::string bytes;
  row.read_all(SqlBlob{bytes});
  return bytes;
}

Status check_identity(const Database& database) {
  ASSIGN_OR_RETURN(const auto is, database.identity("read the answers"));
  if (is.application == kAnswerStoreApplicationId || is.empty) return {};
  return Error{database.file().string() + ": is a SQLite file of another kind (application id " +
               std::to_string(is.application) + "); take another folder, or move the file away"};
}

constexpr double kFlushInterval_s = 1;  // each costs a disk write

}  // namespace

Result<AnswerStore> AnswerStore::open(const std::filesystem::path& file,
                                      const std::string& fingerprint) {
  std::error_code code;
  const bool there = std::filesystem::exists(file, code);
  ASSIGN_OR_RETURN(auto database,
                   Database::open(file, there ? Database::Mode::kWrite : Database::Mode::kCreate));
  RETURN_IF_ERROR(check_identity(database));
  const std::string tables =
      kAnswerTables + ("PRAGMA application_id = " + std::to_string(kAnswerStoreApplicationId));
  ASSIGN_OR_RETURN(auto transaction, SqlTransaction::begin(database));
  RETURN_IF_ERROR(database.exec(tables, "keep answers"));
  RETURN_IF_ERROR(transaction.commit());
  ASSIGN_OR_RETURN(const auto last, database.integer("SELECT coalesce(max(number), 0) FROM answers",
                                                     "read the answers"));
  AnswerStore store(std::move(database), fingerprint);
  store.next_number_ = last + 1;
  return store;
}

std::int64_t AnswerStore::reserve(std::size_t count) {
  const std::int64_t first = next_number_;
  next_number_ += static_cast<std::int64_t>(count);
  return first;
}

Status AnswerStore::add_problem(const std::string& hash, const std::string& bytes) {
  return database_.run("keep a problem", "INSERT OR IGNORE INTO problems VALUES (?, ?)", hash,
                       SqlBlob{bytes});
}

std::string AnswerStore::key(const std::string& problem_hash, const v1::Task& task) const {
  return content_hash(fingerprint_ + '\n' + question_hash(problem_hash, task));
}

Result<std::optional<v1::TaskResult>> AnswerStore::find(const std::string& key) const {
  ASSIGN_OR_RETURN(const auto bytes,
                   database_.row("read answers", "SELECT result FROM answers WHERE question = ?",
                                 first_blob, key));
  std::optional<v1::TaskResult> result;
  if (bytes && !result.emplace().ParseFromString(*bytes)) {
    return Error{database_.file().string() + ": the answer " + key +
                 " is damaged; delete the file and run the command again"};
  }
  return result;
}

Status AnswerStore::add(const std::string& problem_hash, const std::string& stage,
                        const std::vector<Answer>& answers) {
  ASSIGN_OR_RETURN(auto transaction, SqlTransaction::begin(database_));
  ASSIGN_OR_RETURN(auto insert,
                   database_.prepare("INSERT OR IGNORE INTO answers VALUES (?, ?, ?, ?, ?, ?, ?)",
                                     "keep answers"));
  for (const Answer& answer : answers) {
    const std::string task = answer.task->SerializeAsString();
    const std::string result = answer.result->SerializeAsString();
    insert.bind_all(answer.key, answer.number, problem_hash, fingerprint_, stage, SqlBlob{task},
                    SqlBlob{result});
    RETURN_IF_ERROR(insert.run());
  }
  return transaction.commit();
}

Result<std::int64_t> AnswerStore::count() const {
  return database_.integer("SELECT count(*) FROM answers", "count answers");
}

Status AnswerStore::forget() {
  return database_.exec("DELETE FROM answers; DELETE FROM problems; VACUUM", "forget the answers");
}

Status AnswerStore::set_command(const std::string& json) {
  return database_.run("say how far it is", "INSERT OR REPLACE INTO command VALUES (1, ?)", json);
}

Result<std::optional<std::string>> read_command(const std::filesystem::path& file) {
  ASSIGN_OR_RETURN(auto database, Database::open(file, Database::Mode::kQueryOnly));
  RETURN_IF_ERROR(check_identity(database));
  ASSIGN_OR_RETURN(const auto there,
                   database.integer("SELECT count(*) FROM sqlite_master WHERE name = 'command'",
                                    "read the command"));
  if (there == 0) return std::optional<std::string>();  // of an older program
  return database.row("read the command", "SELECT record FROM command",
                      [](const SqlStatement& row) { return row.text(0); });
}

Result<std::vector<AnsweredStage>> read_stages(const std::filesystem::path& file) {
  ASSIGN_OR_RETURN(auto database, Database::open(file, Database::Mode::kQueryOnly));
  RETURN_IF_ERROR(check_identity(database));
  return database.rows("read the stages",
                       "SELECT stage, count(*) FROM answers GROUP BY stage ORDER BY min(number)",
                       [](const SqlStatement& row) {
                         return AnsweredStage{row.text(0), row.integer(1)};
                       });
}

RecordedFarm::RecordedFarm(std::shared_ptr<Farm> farm, AnswerStore* store, Clock clock)
    : farm_(std::move(farm)), store_(store), clock_(clock) {
  if (store_ == nullptr) return;
  farm_->watch_answers(
      [this](std::size_t task, const v1::TaskResult& result) { on_answer(task, result); });
}

RecordedFarm::~RecordedFarm() { farm_->watch_answers({}); }

std::string RecordedFarm::add_problem(const v1::Problem& problem) {
  std::string hash = farm_->add_problem(problem);
  if (store_ != nullptr) unkept_[hash] = serialise(problem);
  return hash;
}

Result<RecordedFarm::Open> RecordedFarm::look_up(const std::string& problem_hash,
                                                 const std::vector<v1::Task>& tasks,
                                                 std::vector<v1::TaskResult>& results) {
  Open open;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    std::string key;
    if (store_ != nullptr) {
      key = store_->key(problem_hash, tasks[i]);
      ASSIGN_OR_RETURN(auto found, store_->find(key));
      if (found) {
        results[i] = std::move(*found);
        continue;
      }
    }
    open.tasks.push_back(tasks[i]);
    open.places.push_back(i);
    open.keys.push_back(std::move(key));
  }
  open.kept.resize(open.tasks.size(), store_ == nullptr);
  if (store_ != nullptr) open.first_number = store_->reserve(open.tasks.size());
  return open;
}

void RecordedFarm::on_answer(std::size_t task, const v1::TaskResult& result) {
  if (task >= open_.tasks.size() || open_.kept[task]) return;
  waiting_[task] = result;
  if (clock_() - flushed_s_ < kFlushInterval_s) return;
  if (Status s = flush(); !s && trouble_) trouble_ = s;
}

Status RecordedFarm::flush() {
  std::vector<AnswerStore::Answer> answers;
  for (const auto& [k, result] : waiting_) {
    if (open_.kept[k] || result.outcome() == v1::WORKER_FAILED) continue;
    const auto number = open_.first_number + static_cast<std::int64_t>(k);
    answers.push_back({open_.keys[k], number, &open_.tasks[k], &result});
  }
  flushed_s_ = clock_();
  if (answers.empty()) return {};
  RETURN_IF_ERROR(store_->add(problem_hash_, stage_, answers));
  for (const auto& [k, result] : waiting_) open_.kept[k] = true;
  waiting_.clear();
  return {};
}

void RecordedFarm::report_progress(std::uint64_t done) {
  if (watcher_) watcher_({remembered_, simulated_ + done, asked_});
}

Result<std::vector<v1::TaskResult>> RecordedFarm::run(
    const std::string& problem_hash, const std::vector<v1::Task>& tasks,
    const std::function<void(const FarmProgress&)>& on_progress) {
  if (const auto fresh = unkept_.find(problem_hash); fresh != unkept_.end()) {
    RETURN_IF_ERROR(store_->add_problem(problem_hash, fresh->second));
    unkept_.erase(fresh);
  }
  std::vector<v1::TaskResult> results(tasks.size());
  ASSIGN_OR_RETURN(open_, look_up(problem_hash, tasks, results));
  problem_hash_ = problem_hash;
  waiting_.clear();
  trouble_ = {};
  const std::size_t at_hand = tasks.size() - open_.tasks.size();
  remembered_ += at_hand;
  asked_ += tasks.size();
  flushed_s_ = clock_();
  report_progress(0);
  if (open_.tasks.empty()) return results;
  auto fresh = farm_->run(problem_hash, open_.tasks, [&](const FarmProgress& progress) {
    report_progress(progress.done);
    if (on_progress) on_progress({at_hand + progress.done, tasks.size()});
  });
  if (!fresh) {
    // The batch is over for the farm, but what it did answer is here.
    static_cast<void>(flush());
    return fresh.error();
  }
  for (std::size_t k = 0; k < fresh->size(); ++k) {
    if (!open_.kept[k]) waiting_[k] = (*fresh)[k];
  }
  if (trouble_) trouble_ = flush();
  if (!trouble_) return trouble_.error();
  simulated_ += open_.tasks.size();
  report_progress(0);
  for (std::size_t k = 0; k < open_.tasks.size(); ++k) {
    results[open_.places[k]] = std::move((*fresh)[k]);
  }
  return results;
}

}  // namespace gapfarm
