#include <gtest/gtest.h>
#include <poll.h>

#include "worker/service.h"

namespace gapfarm::evaluation_thread_test {

std::vector<Work> echoes(std::uint64_t count) {
  std::vector<Work> work(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    work[i].job.set_attempt_id(i);
    work[i].job.mutable_task()->mutable_echo()->set_payload("x");
  }
  return work;
}

struct Taken {
  std::vector<std::uint64_t> attempts;
  int times = 0;
};

// Takes results as the service does: when there is something to be reported.
Taken take_all(EvaluationThread& evaluation, std::size_t count) {
  Taken taken;
  while (taken.attempts.size() < count) {
    pollfd polled{evaluation.fd(), POLLIN, 0};
    if (poll(&polled, 1, 60000) != 1) break;
    ++taken.times;
    for (const v1::JobResult& result : evaluation.take_finished()) {
      taken.attempts.push_back(result.attempt_id());
    }
  }
  return taken;
}

TEST(EvaluationThread, ReportsOfEveryResultInOrder) {
  EvaluationThread evaluation;
  for (std::uint64_t count = 1; count < 10; ++count) {
    evaluation.give(echoes(count));
    const Taken taken = take_all(evaluation, count);
    ASSERT_EQ(taken.attempts.size(), count);
    for (std::uint64_t i = 0; i < count; ++i) EXPECT_EQ(taken.attempts[i], i);
  }
  EXPECT_TRUE(evaluation.idle());
}

TEST(EvaluationThread, ReportsOfShortTasksTogether) {
  EvaluationThread evaluation;
  evaluation.give(echoes(200));
  const Taken taken = take_all(evaluation, 200);
  EXPECT_EQ(taken.attempts.size(), 200u);
  EXPECT_LT(taken.times, 100);
}

// What was held back because more was to come is reported when that is taken away.
TEST(EvaluationThread, ReportsOfWhatIsDoneWhenTheRestIsDropped) {
  EvaluationThread evaluation;
  for (int round = 0; round < 50; ++round) {
    evaluation.give(echoes(100));
    const std::size_t dropped = evaluation.drop_all().size();
    EXPECT_EQ(take_all(evaluation, 100 - dropped).attempts.size(), 100 - dropped);
  }
}

}  // namespace gapfarm::evaluation_thread_test
