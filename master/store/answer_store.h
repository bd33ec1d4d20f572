// Every simulation that an experiment asked for, with its answer: evaluation is pure, so whoever
// asks the same again, after a stop or to check a figure, need not simulate.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "gapfarm/v1/task.pb.h"
#include "master/farm/farm.h"
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

  // A number that no answer has: questions keep the order in which they were asked, whenever they
  // are answered.
  std::int64_t reserve() { return next_number_++; }

  struct Answer {
    std::string key;
    std::int64_t number = 0;  // of those reserved
    v1::Task task;
    v1::TaskResult result;
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

// What of a recorded farm's work is done, in all.
struct RecordedProgress {
  std::uint64_t remembered = 0;  // answers that were at hand
  std::uint64_t simulated = 0;   // those of the batch in work included
  std::uint64_t asked = 0;       // all tasks so far, of the batch in work too
};

// A farm that remembers: what was asked before comes from the store, the rest from the farm behind
// it and into the store.
class RecordedFarm : public Farm {
 public:
  // Seconds of a clock that never goes back.
  // The store outlives this.  Null: nothing is remembered, and progress is shown all the same.
  RecordedFarm(std::shared_ptr<Farm> farm, AnswerStore* store, Clock clock = monotonic_seconds)
      : farm_(std::move(farm)), store_(store), clock_(clock) {}

  // Written beside the answers from now on.
  void set_stage(std::string stage) { stage_ = std::move(stage); }
  // Called when a batch begins, while it is answered, now and then, and when it is done.
  void watch(std::function<void(const RecordedProgress&)> watcher) {
    watcher_ = std::move(watcher);
  }

  std::string add_problem(const v1::Problem& problem) override;
  // Errors: the farm's and the store's.  Answers are kept as they come, so that
  // neither an error nor the end of this process loses more than about a second's; those that say
  // more of the workers than of the question (WORKER_FAILED) are not kept.
  Status stream(const std::string& problem_hash, std::vector<v1::Task> tasks,
                const TakeAnswer& take, const OnProgress& on_progress = {}) override;
  std::vector<WorkerStatus> workers() const override { return farm_->workers(); }
  std::vector<FleetStatus> fleets() const override { return farm_->fleets(); }
  std::vector<std::string> endpoints() const override { return farm_->endpoints(); }
  std::uint64_t given_up() const override { return farm_->given_up(); }

  std::uint64_t remembered() const { return remembered_; }
  std::uint64_t simulated() const { return simulated_; }

 private:
  struct Batch;
  // Of these tasks, and those that remembered answers lead to, the ones to be simulated.
  Result<std::vector<v1::Task>> look_up(Batch& batch, std::vector<v1::Task> tasks,
                                        const TakeAnswer& take);
  Status flush(Batch& batch);
  void report_progress() const {
    if (watcher_) watcher_({remembered_, simulated_, asked_});
  }

  std::shared_ptr<Farm> farm_;
  AnswerStore* store_;
  Clock clock_;
  std::string stage_;
  std::function<void(const RecordedProgress&)> watcher_;
  std::map<std::string, std::string> unkept_;  // problems by hash: bytes, until first asked about
  std::uint64_t remembered_ = 0;
  std::uint64_t simulated_ = 0;
  std::uint64_t asked_ = 0;
};

}  // namespace gapfarm
