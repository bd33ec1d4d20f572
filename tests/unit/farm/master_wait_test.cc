#include "worker/master_wait.h"

#include <gmock/gmock.h>

namespace gapfarm::master_wait_test {

using testing::HasSubstr;

TEST(MasterWait, ReportsAtOnceForWhomItWaitsAndThenEveryMinute) {
  MasterWait wait("tcp://10.0.0.5:5599");
  EXPECT_EQ(*wait.message(false, 5), "waiting for a master at tcp://10.0.0.5:5599");
  int messages = 0;
  std::string last;
  for (double t = 5.5; t < 190; t += 0.5) {
    if (const auto message = wait.message(false, t)) {
      ++messages;
      last = *message;
    }
  }
  EXPECT_EQ(messages, 3);
  EXPECT_THAT(last, HasSubstr("tcp://10.0.0.5:5599, for 3 min"));
}

TEST(MasterWait, ReportsComingAndGoing) {
  MasterWait wait("ipc:///tmp/farm");
  EXPECT_EQ(*wait.message(true, 0), "working for the master at ipc:///tmp/farm");
  EXPECT_FALSE(wait.message(true, 1000));
  EXPECT_THAT(*wait.message(false, 1001), HasSubstr("the master has gone; waiting for the next"));
  EXPECT_FALSE(wait.message(false, 1002));
  EXPECT_THAT(*wait.message(true, 1003), HasSubstr("working"));
}

}  // namespace gapfarm::master_wait_test
