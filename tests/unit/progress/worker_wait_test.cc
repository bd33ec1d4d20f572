#include <gmock/gmock.h>

#include "common/progress/overall_progress.h"

namespace gapfarm::worker_wait_test {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST(WorkerWait, NamesTheAddressAndLaterHowToStartOne) {
  WorkerWait wait({"tcp://0.0.0.0:5555"});
  EXPECT_FALSE(wait.message(0, 100));
  EXPECT_FALSE(wait.message(0, 100.9)) << "they are on their way";
  EXPECT_THAT(*wait.message(0, 110), AllOf(HasSubstr("waiting for workers at tcp://0.0.0.0:5555"),
                                           HasSubstr("10 s"), Not(HasSubstr("gapfarm-worker"))));
  EXPECT_THAT(*wait.message(0, 131), HasSubstr("gapfarm-worker --connect tcp://THIS_HOST:5555"));
  EXPECT_FALSE(wait.message(1, 132));
  EXPECT_FALSE(wait.message(0, 133)) << "it begins anew when the last one goes";
  EXPECT_TRUE(wait.message(0, 135));
}

TEST(WorkerWait, OwnWorkersHaveNoAddressToConnectTo) {
  WorkerWait wait({});
  EXPECT_FALSE(wait.message(0, 0));
  EXPECT_THAT(*wait.message(0, 40), AllOf(HasSubstr("local workers"), Not(HasSubstr("--connect"))));
}

}  // namespace gapfarm::worker_wait_test
