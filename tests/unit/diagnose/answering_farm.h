// A farm of one function in place of workers.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/problem/problem.h"
#include "tests/immediate_farm.h"

namespace gapfarm {

class AnsweringFarm : public tests::ImmediateFarm {
 public:
  std::string add_problem(const v1::Problem& problem) override {
    const std::string hash = problem_hash(problem);
    problems_[hash] = from_proto(problem).value();
    return hash;
  }

  std::size_t asked = 0;

 private:
  virtual v1::TaskResult answer(const Problem& problem, const v1::Task& task) const = 0;
  Result<v1::TaskResult> answer_task(const std::string& hash, const v1::Task& task) final {
    ++asked;
    return answer(problems_.at(hash), task);
  }

  std::map<std::string, Problem> problems_;
};

}  // namespace gapfarm
