#include "worker/evaluation_thread.h"

#include <gtest/gtest.h>
#include <poll.h>

namespace gapfarm {
namespace {

std::vector<Work> echoes(std::uint64_t count) {
  std::vector<Work> work(count);
  for (std::uint64_t i = 0; i < count; ++i) {
    work[i].job.set_attempt_id(i);
    work[i].job.mutable_task()->mutable_echo()->set_payload("x");
  }
  return work;
}

struct Told {
  std::vector<std::uint64_t> attempts;
  int times = 0;
};

// Takes results as the service does: when there is something to be told.
Told take_all(EvaluationThread& evaluation, std::size_t count) {
  Told told;
  while (told.attempts.size() < count) {
    pollfd polled{evaluation.fd(), POLLIN, 0};
    if (poll(&polled, 1, 60000) != 1) break;
    ++told.times;
    for (const v1::JobResult& result : evaluation.take_finished()) {
      told.attempts.push_back(result.attempt_id());
    }
  }
  return told;
}

TEST(EvaluationThread, TellsOfEveryResultInOrder) {
  EvaluationThread evaluation;
  for (std::uint64_t count = 1; count < 10; ++count) {
    evaluation.give(echoes(count));
    const Told told = take_all(evaluation, count);
    ASSERT_EQ(told.attempts.size(), count);
    for (std::uint64_t i = 0; i < count; ++i) EXPECT_EQ(told.attempts[i], i);
  }
  EXPECT_TRUE(evaluation.idle());
}

TEST(EvaluationThread, TellsOfShortTasksTogether) {
  EvaluationThread evaluation;
  evaluation.give(echoes(200));
  const Told told = take_all(evaluation, 200);
  EXPECT_EQ(told.attempts.size(), 200u);
  EXPECT_LT(told.times, 100);
}

// What was held back because more was to come is told when that is taken away.
TEST(EvaluationThread, TellsOfWhatIsDoneWhenTheRestIsDropped) {
  EvaluationThread evaluation;
  for (int round = 0; round < 50; ++round) {
    evaluation.give(echoes(100));
    const std::size_t dropped = evaluation.drop_all().size();
    EXPECT_EQ(take_all(evaluation, 100 - dropped).attempts.size(), 100 - dropped);
  }
}

}  // namespace
}  // namespace gapfarm
