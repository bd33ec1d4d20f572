#include "common/net/master_wait.h"

#include <gmock/gmock.h>

#include <vector>

namespace gapfarm::master_wait_test {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(MasterWait, ReportsAtOnceForWhomItWaitsAndThenEverMoreRarely) {
  MasterWait wait("tcp://10.0.0.5:5599");
  EXPECT_EQ(*wait.message(false, 5), "waiting for a master at tcp://10.0.0.5:5599");
  std::vector<double> minutes;
  std::string last;
  for (double t = 5.5; t < 5 + 16 * 60; t += 0.5) {
    if (const auto message = wait.message(false, t)) {
      minutes.push_back((t - 5) / 60);
      last = *message;
    }
  }
  EXPECT_THAT(minutes, ElementsAre(1, 3, 7, 15));
  EXPECT_THAT(last, HasSubstr("tcp://10.0.0.5:5599, for 15 min now; does one listen there"));
  EXPECT_FALSE(wait.is_over(1e9));
  // Once an hour in the end.
  unsigned late = 0;
  for (double t = 86400; t < 2 * 86400; t += 1) late += wait.message(false, t).has_value();
  EXPECT_NEAR(late, 24, 1);
}

TEST(MasterWait, GivesUpAtItsLimitAndReportsItBefore) {
  MasterWait wait("tcp://m:1", 600);
  EXPECT_FALSE(wait.is_over(1e9));  // it has not begun
  EXPECT_THAT(*wait.message(false, 0), HasSubstr("giving up when none has come in 10 min"));
  EXPECT_THAT(*wait.message(false, 60), HasSubstr("for 60 s now of 10 min"));
  EXPECT_FALSE(wait.is_over(600));
  EXPECT_TRUE(wait.is_over(600.1));
  EXPECT_THAT(wait.over(), HasSubstr("no master at tcp://m:1 for 10 min; does one listen"));
  wait.message(true, 601);
  EXPECT_FALSE(wait.is_over(1e9));
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
