#include <gtest/gtest.h>

#include <chrono>
#include <map>

#include "common/trials/files.h"
#include "master/experiments/blind_check/tally.h"
#include "master/farm/farm.h"
#include "tests/unit/blind/worker_farm.h"

namespace gapfarm::children_test {

class Children : public ::testing::Test {
 protected:
  ChildJob shell(const std::string& id, const std::string& script) {
    return {id, {"/bin/sh", "-c", script}, folder_ / (id + ".log")};
  }
  ChildrenOptions options(std::map<std::string, ChildEnd>& ends) {
    ChildrenOptions options;
    options.on_end = [&ends](const ChildJob& job, const ChildEnd& end) { ends[job.id] = end; };
    return options;
  }

  TemporaryFolder folder_;
};

TEST_F(Children, EveryWayToEndIsAnOutcome) {
  std::map<std::string, ChildEnd> ends;
  ChildrenOptions with = options(ends);
  with.at_once = 2;
  const std::vector<ChildJob> jobs = {shell("good", "echo out; echo err >&2"),
                                      shell("bad", "exit 7"), shell("crash", "kill -SEGV $$")};
  ASSERT_TRUE(run_children(jobs, with).ok());
  EXPECT_EQ(ends.at("good").state, ChildState::kDone);
  EXPECT_EQ(*read_text_file(folder_ / "good.log"), "out\nerr\n");
  EXPECT_EQ(ends.at("bad").state, ChildState::kFailed);
  EXPECT_EQ(ends.at("bad").status, 7);
  EXPECT_EQ(ends.at("crash").state, ChildState::kCrashed);
  EXPECT_EQ(ends.at("crash").status, SIGSEGV);
}

TEST_F(Children, WhatTheirOwnChildrenTookIsCountedToo) {
  std::map<std::string, ChildEnd> ends;
  const std::string count = "i=0; while [ $i -lt 50000 ]; do i=$((i+1)); done";
  ASSERT_TRUE(run_children({shell("busy", "(" + count + ") & wait"), shell("idle", "sleep 0.1")},
                           options(ends))
                  .ok());
  EXPECT_GT(ends.at("busy").cpu_s, 2 * ends.at("idle").cpu_s);
}

TEST_F(Children, TooSlowIsATimeout) {
  std::map<std::string, ChildEnd> ends;
  ChildrenOptions with = options(ends);
  with.time_limit_s = 0.05;
  ASSERT_TRUE(run_children({shell("slow", "exec sleep 60")}, with).ok());
  EXPECT_EQ(ends.at("slow").state, ChildState::kTimedOut);
}

TEST_F(Children, StopEndsThemUnreported) {
  std::map<std::string, ChildEnd> ends;
  StopSource stop;
  ChildrenOptions with = options(ends);
  with.stop = &stop;
  with.on_tick = [&stop](std::size_t) { stop.request(); };
  const auto begin = std::chrono::steady_clock::now();
  const Status status = run_children({shell("slow", "exec sleep 60")}, with);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::kStopped);
  EXPECT_TRUE(ends.empty());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

TEST_F(Children, AProgramThatIsNotThereIsAnError) {
  std::map<std::string, ChildEnd> ends;
  const Status status =
      run_children({{"a", {"/no/such/program"}, folder_ / "a.log"}}, options(ends));
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("/no/such/program"), std::string::npos);
}

}  // namespace gapfarm::children_test
