#include "master/store/answer_store.h"

#include <utility>

#include "common/base/hash.h"
#include "common/problem/problem.h"
#include "master/store/tables.h"

namespace gapfarm {
namespace {

std::string first_text(const SqlStatement& row) { return row.text(0); }

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
                                 first_text, key));
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
    const std::string task = answer.task.SerializeAsString();
    const std::string result = answer.result.SerializeAsString();
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
  return database.row("read the command", "SELECT record FROM command", first_text);
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

struct RecordedFarm::Batch {
  struct Open {
    std::size_t place = 0;  // for who asks
    AnswerStore::Answer answer;
  };
  const std::string& problem_hash;
  double flushed_s;
  std::size_t places = 0;
  std::vector<Open> open = {};                     // by the place for the farm that answers
  std::vector<AnswerStore::Answer> answered = {};  // not in the store yet
};

std::string RecordedFarm::add_problem(const v1::Problem& problem) {
  std::string hash = farm_->add_problem(problem);
  if (store_ != nullptr) unkept_[hash] = serialise(problem);
  return hash;
}

Result<std::vector<v1::Task>> RecordedFarm::look_up(Batch& batch, std::vector<v1::Task> tasks,
                                                    const TakeAnswer& take) {
  std::vector<v1::Task> open;
  asked_ += tasks.size();
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    Batch::Open question{batch.places++, {}};
    if (store_ != nullptr) {
      question.answer.key = store_->key(batch.problem_hash, tasks[i]);
      ASSIGN_OR_RETURN(auto found, store_->find(question.answer.key));
      if (found) {
        ++remembered_;
        ASSIGN_OR_RETURN(auto more, take(question.place, std::move(*found)));
        asked_ += more.size();
        std::move(more.begin(), more.end(), std::back_inserter(tasks));
        continue;
      }
      question.answer.number = store_->reserve();
      question.answer.task = tasks[i];
    }
    batch.open.push_back(std::move(question));
    open.push_back(std::move(tasks[i]));
  }
  return open;
}

Status RecordedFarm::flush(Batch& batch) {
  batch.flushed_s = clock_();
  if (batch.answered.empty()) return {};
  RETURN_IF_ERROR(store_->add(batch.problem_hash, stage_, batch.answered));
  batch.answered.clear();
  return {};
}

Status RecordedFarm::stream(const std::string& problem_hash, std::vector<v1::Task> tasks,
                            const TakeAnswer& take, const OnProgress& on_progress) {
  if (const auto fresh = unkept_.find(problem_hash); fresh != unkept_.end()) {
    RETURN_IF_ERROR(store_->add_problem(problem_hash, fresh->second));
    unkept_.erase(fresh);
  }
  Batch batch{problem_hash, clock_()};
  ASSIGN_OR_RETURN(auto open, look_up(batch, std::move(tasks), take));
  report_progress();
  if (open.empty()) return {};
  const auto on_answer = [&](std::size_t k,
                             v1::TaskResult result) -> Result<std::vector<v1::Task>> {
    ++simulated_;
    Batch::Open& question = batch.open[k];
    if (store_ != nullptr && result.outcome() != v1::WORKER_FAILED) {
      question.answer.result = result;
      batch.answered.push_back(std::move(question.answer));
    }
    if (clock_() - batch.flushed_s >= kFlushInterval_s) RETURN_IF_ERROR(flush(batch));
    ASSIGN_OR_RETURN(auto more, take(question.place, std::move(result)));
    return look_up(batch, std::move(more), take);
  };
  Status status =
      farm_->stream(problem_hash, std::move(open), on_answer, [&](const FarmProgress& progress) {
        report_progress();
        const std::size_t at_hand = batch.places - batch.open.size();
        if (on_progress) on_progress({at_hand + progress.done, at_hand + progress.total});
      });
  // After an error, too: what was answered is here.
  Status kept = flush(batch);
  report_progress();
  return status ? kept : status;
}

}  // namespace gapfarm
