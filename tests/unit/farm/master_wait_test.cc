#include "worker/master_wait.h"

#include <gmock/gmock.h>

namespace gapfarm {
namespace {

using testing::HasSubstr;

TEST(MasterWait, SaysAtOnceForWhomItWaitsAndThenEveryMinute) {
  MasterWait wait("tcp://10.0.0.5:5599");
  EXPECT_EQ(*wait.say(false, 5), "waiting for a master at tcp://10.0.0.5:5599");
  int said = 0;
  std::string last;
  for (double t = 5.5; t < 190; t += 0.5) {
    if (const auto words = wait.say(false, t)) {
      ++said;
      last = *words;
    }
  }
  EXPECT_EQ(said, 3);
  EXPECT_THAT(last, HasSubstr("tcp://10.0.0.5:5599, for 3 min"));
}

TEST(MasterWait, TellsComingAndGoing) {
  MasterWait wait("ipc:///tmp/farm");
  EXPECT_EQ(*wait.say(true, 0), "working for the master at ipc:///tmp/farm");
  EXPECT_FALSE(wait.say(true, 1000));
  EXPECT_THAT(*wait.say(false, 1001), HasSubstr("the master has gone; waiting for the next"));
  EXPECT_FALSE(wait.say(false, 1002));
  EXPECT_THAT(*wait.say(true, 1003), HasSubstr("working"));
}

}  // namespace
}  // namespace gapfarm
