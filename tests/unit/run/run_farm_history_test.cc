// Who worked when, from what the store shows.
#include <gmock/gmock.h>

#include "master/run/run_page.h"

namespace gapfarm::run_farm_history_test {

using testing::HasSubstr;

std::vector<unsigned> workers_of(const RunTimeline& timeline) {
  std::vector<unsigned> workers;
  for (const auto& count : timeline.counts) workers.push_back(count.workers);
  return workers;
}

TEST(Timeline, FollowsWhoComesGoesAndFails) {
  const std::vector<StoredWorkerEvent> events = {
      {100, "master", "", "m", "master 1 begins"},  {101, "joined", "a", "h1", "joined from h1"},
      {102, "joined", "b", "h2", "joined from h2"}, {110, "died", "a", "h1", "was killed"},
      {111, "refused", "x", "", "another build"},   {120, "left", "b", "h2", "left: done"}};
  const RunTimeline timeline = timeline_of(events, 130, true);
  EXPECT_THAT(workers_of(timeline), testing::ElementsAre(0, 1, 2, 1, 1, 0, 0));
  ASSERT_EQ(timeline.spans.size(), 2u);
  EXPECT_EQ(timeline.spans[0].to_unix_s, 110);
  EXPECT_EQ(timeline.spans[0].end, "was killed");
  EXPECT_EQ(timeline.spans[1].end, "") << "leaving is no failure";
  ASSERT_EQ(timeline.marks.size(), events.size());
  EXPECT_EQ(timeline.marks[3].kind, "failed");
  EXPECT_THAT(timeline.marks[3].text, HasSubstr("a (h1) was killed"));
}

TEST(Timeline, WithAMasterItsWorkersGo) {
  const std::vector<StoredWorkerEvent> events = {{100, "master", "", "m", "master 1 begins"},
                                                 {101, "joined", "a", "h", "joined from h"},
                                                 {140, "end", "", "m", "the last heard"},
                                                 {200, "master", "", "m", "master 2 begins"},
                                                 {201, "joined", "a", "h", "joined from h"}};
  const RunTimeline dead = timeline_of(events, 250, false);
  EXPECT_THAT(workers_of(dead), testing::ElementsAre(0, 1, 0, 0, 1, 0));
  ASSERT_EQ(dead.spans.size(), 2u);
  EXPECT_EQ(dead.spans[0].to_unix_s, 140);
  EXPECT_EQ(dead.spans[1].to_unix_s, 250);
  EXPECT_EQ(timeline_of(events, 250, true).counts.back().workers, 1u);
  EXPECT_TRUE(timeline_of({}, 250, true).counts.empty());
}

TEST(Timeline, StaysSmall) {
  std::vector<StoredWorkerEvent> events = {{0, "master", "", "m", "master 1 begins"}};
  for (int i = 1; i < 20000; ++i) {
    const std::string name = "w" + std::to_string(i);
    events.push_back({1.0 * i, "joined", name, "h", "joined from h"});
    if (i % 3 == 0) events.push_back({1.0 * i, "died", name, "h", "was killed"});
  }
  const RunTimeline timeline = timeline_of(events, 30000, true);
  EXPECT_LE(timeline.counts.size(), 2000u);
  EXPECT_LE(timeline.marks.size(), 300u);
  EXPECT_TRUE(timeline.spans.empty());
}

}  // namespace gapfarm::run_farm_history_test
