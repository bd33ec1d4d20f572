// worker/evaluate.h without Bullet: answers at once, or ends the process or hangs when reported to.
// A machine that computes wrongly has GAPFARM_FAKE_ERROR in its environment: what it adds to a
// fitness.
#include "worker/evaluate.h"

#include <time.h>

#include <cstdlib>

namespace gapfarm {
namespace {

class FakePrepared : public PreparedProblem {
 public:
  explicit FakePrepared(const v1::Problem& message) { problem_.scenario = message.scenario(); }
  const Problem& problem() const override { return problem_; }

 private:
  Problem problem_;
};

double error() {
  static const char* const text = getenv("GAPFARM_FAKE_ERROR");
  return text != nullptr ? strtod(text, nullptr) : 0;
}

// Of this thread: time for which others had the core is no work.
double cpu_seconds() {
  timespec t = {};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

Result<std::unique_ptr<PreparedProblem>> prepare(const v1::Problem& message) {
  if (message.scenario() == "bad") return Error{"a bad problem"};
  return std::unique_ptr<PreparedProblem>(std::make_unique<FakePrepared>(message));
}

v1::TaskResult evaluate(const PreparedProblem* prepared, const v1::Task& task, StepCounter* steps) {
  v1::TaskResult result;
  result.set_outcome(v1::OK);
  if (task.has_echo()) {
    if (task.echo().payload() == "crash") abort();
    // An endless loop that computes; a sleep would do as well.
    for (volatile bool hangs = task.echo().payload() == "hang"; hangs;) cpu_seconds();
    if (task.echo().busy_us() > 0) {
      const double until = cpu_seconds() + 1e-6 * static_cast<double>(task.echo().busy_us());
      while (cpu_seconds() < until) count_step(steps);
    }
    result.set_echo(task.echo().payload());
  } else if (prepared == nullptr) {
    result.set_outcome(v1::INVALID_REQUEST);
  } else {
    result.set_message(prepared->problem().scenario);
    result.mutable_evaluate()->set_fitness(2 * task.evaluate().point().genome(0) + error());
  }
  return result;
}

const std::string& numeric_class() {
  static const std::string name = "fake";
  return name;
}

}  // namespace gapfarm
