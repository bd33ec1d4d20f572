// Every simulation that an experiment asked for, with its answer: evaluation is pure, so whoever
// asks the same again, after a stop or to check a figure, need not simulate.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "gapfarm/v1/task.pb.h"
#include "master/store/database.h"

namespace gapfarm {

inline constexpr std::int64_t kAnswerStoreApplicationId = 0x67617061;  // "gapa"

class AnswerStore {
 public:
  // Makes the file if there is none.  Answers of other builds stay, but are not found.  Errors: no
  // answer store, damaged, or not to be written, with the remedy.
  static Result<AnswerStore> open(const std::filesystem::path& file,
                                  const std::string& fingerprint);

  // The problem that questions are about; kept once.
  Status add_problem(const std::string& hash, const std::string& bytes);

  // Key of the question in the table `answers`.
  std::string key(const std::string& problem_hash, const v1::Task& task) const;
  Result<std::optional<v1::TaskResult>> find(const std::string& key) const;

  // The first of `count` numbers that no answer has: questions keep the order in which they were
  // asked, whenever they are answered.
  std::int64_t reserve(std::size_t count);

  struct Answer {
    std::string key;
    std::int64_t number = 0;  // of those reserved
    const v1::Task* task = nullptr;
    const v1::TaskResult* result = nullptr;
  };
  // All of them or none.  `stage` says what they were for.
  Status add(const std::string& problem_hash, const std::string& stage,
             const std::vector<Answer>& answers);

  Result<std::int64_t> count() const;
  // Takes all answers, questions and problems out of the file, whose space is given back.
  Status forget();

  // What the command that asks says about itself: one JSON text, replaced each time.
  Status set_command(const std::string& json);

 private:
  AnswerStore(Database database, std::string fingerprint)
      : database_(std::move(database)), fingerprint_(std::move(fingerprint)) {}

  Database database_;
  std::string fingerprint_;
  std::int64_t next_number_ = 1;
};

// How many answers each stage asked for first.
struct AnsweredStage {
  std::string name;
  std::int64_t answers = 0;
};
// In the order in which they began, from a file that may be in use.  Errors: no answer store.
Result<std::vector<AnsweredStage>> read_stages(const std::filesystem::path& file);

// What the command that wrote `file` last reported about itself, from a file that may be in use or
// in a folder that cannot be written; none: it says nothing.  Errors: no answer store.
Result<std::optional<std::string>> read_command(const std::filesystem::path& file);

}  // namespace gapfarm
