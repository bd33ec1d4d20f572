// A farm that remembers: what was asked before comes from the store, the rest from the farm behind
// it and into the store.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "master/farm/farm.h"
#include "master/store/answer_store.h"

namespace gapfarm {

class RecordedFarm : public Farm {
 public:
  // Both outlive this.
  RecordedFarm(Farm& farm, AnswerStore& store) : farm_(farm), store_(store) {}

  // Written beside the answers from now on.
  void set_stage(std::string stage) { stage_ = std::move(stage); }
  // Called as simulations are answered, with their number so far, those at hand not counted.
  void watch(std::function<void(std::uint64_t)> watcher) { watcher_ = std::move(watcher); }

  std::string add_problem(const v1::Problem& problem) override;
  // Errors: the farm's and the store's.  A batch is kept as a whole or not at all; answers that
  // say more of the workers than of the question (WORKER_FAILED) are not kept.
  Result<std::vector<v1::TaskResult>> run(
      const std::string& problem_hash, const std::vector<v1::Task>& tasks,
      const std::function<void(const FarmProgress&)>& on_progress = {}) override;
  std::vector<WorkerStatus> workers() const override { return farm_.workers(); }
  std::uint64_t retries() const override { return farm_.retries(); }

  std::uint64_t remembered() const { return remembered_; }
  std::uint64_t simulated() const { return simulated_; }

 private:
  Farm& farm_;
  AnswerStore& store_;
  std::string stage_;
  std::function<void(std::uint64_t)> watcher_;
  std::map<std::string, std::string> unkept_;  // problems by hash: bytes, until first asked about
  std::uint64_t remembered_ = 0;
  std::uint64_t simulated_ = 0;
};

}  // namespace gapfarm
