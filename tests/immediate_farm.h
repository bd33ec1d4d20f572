// A farm without workers: it answers each task where it is asked.
#pragma once

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "master/farm/farm.h"

namespace gapfarm::tests {

class ImmediateFarm : public Farm {
 public:
  Status stream(const std::string& problem_hash, std::vector<v1::Task> tasks,
                const TakeAnswer& take, const OnProgress& on_progress = {}) override {
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      ASSIGN_OR_RETURN(auto result, answer_task(problem_hash, tasks[i]));
      ASSIGN_OR_RETURN(auto more, take(i, std::move(result)));
      std::move(more.begin(), more.end(), std::back_inserter(tasks));
      if (on_progress) on_progress({i + 1, tasks.size()});
    }
    return {};
  }

 protected:
  virtual Result<v1::TaskResult> answer_task(const std::string& problem_hash,
                                             const v1::Task& task) = 0;
};

}  // namespace gapfarm::tests
