// A farm that remembers: what was asked before comes from the store, the rest from the farm behind
// it and into the store.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "master/farm/answer_watch.h"
#include "master/farm/farm.h"
#include "master/store/answer_store.h"

namespace gapfarm {

// What of a recorded farm's work is done, in all.
struct RecordedProgress {
  std::uint64_t remembered = 0;  // answers that were at hand
  std::uint64_t simulated = 0;   // those of the batch in work included
  std::uint64_t asked = 0;       // all tasks so far, of the batch in work too
};

class RecordedFarm : public Farm {
 public:
  // Seconds of a clock that never goes back.
  using Clock = double (*)();

  // All outlive this.  `answers`: of the same farm; null: it does not report them one by one.
  RecordedFarm(Farm& farm, AnswerStore& store, AnswerSource* answers = nullptr);
  RecordedFarm(Farm& farm, AnswerStore& store, AnswerSource* answers, Clock clock);
  ~RecordedFarm() override;
  RecordedFarm(const RecordedFarm&) = delete;
  RecordedFarm& operator=(const RecordedFarm&) = delete;

  // Written beside the answers from now on.
  void set_stage(std::string stage) { stage_ = std::move(stage); }
  // Called when a batch begins, while it is answered, now and then, and when it is done.
  void watch(std::function<void(const RecordedProgress&)> watcher) {
    watcher_ = std::move(watcher);
  }

  std::string add_problem(const v1::Problem& problem) override;
  // Errors: the farm's and the store's.  Answers are kept as they come (AnswerSource), so that
  // neither an error nor the end of this process loses more than about a second's; those that say
  // more of the workers than of the question (WORKER_FAILED) are not kept.
  Result<std::vector<v1::TaskResult>> run(
      const std::string& problem_hash, const std::vector<v1::Task>& tasks,
      const std::function<void(const FarmProgress&)>& on_progress = {}) override;
  std::vector<WorkerStatus> workers() const override { return farm_.workers(); }
  std::uint64_t retries() const override { return farm_.retries(); }

  std::uint64_t remembered() const { return remembered_; }
  std::uint64_t simulated() const { return simulated_; }

 private:
  // The tasks of a batch that the store has no answer to.
  struct Open {
    std::vector<v1::Task> tasks;
    std::vector<std::size_t> places;  // in the batch
    std::vector<std::string> keys;
    std::vector<bool> kept;
    std::int64_t first_number = 0;
  };
  Result<Open> look_up(const std::string& problem_hash, const std::vector<v1::Task>& tasks,
                       std::vector<v1::TaskResult>& results);
  void on_answer(std::size_t task, const v1::TaskResult& result);
  Status flush();
  void report_progress(std::uint64_t done);

  Farm& farm_;
  AnswerStore& store_;
  AnswerSource* source_;
  Clock clock_;
  std::string stage_;
  std::function<void(const RecordedProgress&)> watcher_;
  std::map<std::string, std::string> unkept_;  // problems by hash: bytes, until first asked about
  std::uint64_t remembered_ = 0;
  std::uint64_t simulated_ = 0;
  std::uint64_t asked_ = 0;
  // Of the batch in work.
  std::string problem_hash_;
  Open open_;
  std::map<std::size_t, v1::TaskResult> waiting_;  // answered, not in the store yet
  double flushed_s_ = 0;
  Status trouble_;  // of the store
};

}  // namespace gapfarm
