// A farm of one worker in this process: real simulations, no sockets.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "common/config/settings.h"
#include "tests/immediate_farm.h"
#include "tests/temporary_folder.h"
#include "worker/evaluate.h"

namespace gapfarm::tests {

class WorkerFarm : public ImmediateFarm {
 public:
  std::string add_problem(const v1::Problem& problem) override;

 protected:
  Result<v1::TaskResult> answer_task(const std::string& problem_hash,
                                     const v1::Task& task) override;

 private:
  std::map<std::string, std::unique_ptr<PreparedProblem>> problems_;
};

// A small experiment: 2 sessions of 12 trials, two durations, 120 Hz.
Config small_config();

}  // namespace gapfarm::tests
