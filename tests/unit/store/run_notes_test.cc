// What a run store keeps beside its generations, and finds again.
#include <gmock/gmock.h>

#include "master/store/run_reader.h"
#include "tests/unit/store/store_fixture.h"

namespace gapfarm::run_notes_test {

class RunNotesTest : public StoreTest {
 protected:
  RunStore store_with(std::uint64_t generations) const {
    auto store = RunStore::create(run(), example_info());
    EXPECT_TRUE(store.ok()) << store.error().message;
    for (std::uint64_t g = 1; g <= generations; ++g) {
      EXPECT_TRUE(store->commit(example_generation(g)).ok());
    }
    return *std::move(store);
  }
};

TEST_F(RunNotesTest, KeepsWhoCameAndWent) {
  {
    RunStore store = store_with(1);
    ASSERT_TRUE(store
                    .add_worker_events({{5.5, "joined", "w1", "h", "joined from h"},
                                        {6.5, "died", "w1", "h", "was killed"}})
                    .ok());
    ASSERT_TRUE(store.add_worker_events({}).ok());
  }
  const RunStore resumed = *RunStore::open(run());
  const auto events = RunReader::open(run())->worker_events(100);
  ASSERT_TRUE(events.ok()) << events.error().message;
  std::vector<std::string> kinds;
  for (const StoredWorkerEvent& event : *events) kinds.push_back(event.kind);
  EXPECT_THAT(kinds, testing::ElementsAre("master", "joined", "died", "end", "master"));
  EXPECT_EQ((*events)[2].unix_s, 6.5);
  EXPECT_EQ((*events)[2].worker, "w1");
  EXPECT_EQ((*events)[2].text, "was killed");
  const auto latest = RunReader::open(run())->worker_events(2);
  ASSERT_EQ(latest->size(), 2u);
  EXPECT_EQ(latest->front().kind, "end");
}

TEST_F(RunNotesTest, FindsAMemberByItsNumber) {
  const RunStore store = store_with(2);
  const auto reader = RunReader::open(run());
  const auto member = reader->member(21);
  ASSERT_TRUE(member.ok() && *member);
  EXPECT_EQ((*member)->generation, 2u);
  EXPECT_EQ((*member)->individual.birth_id, 21u);
  EXPECT_FALSE(*reader->member(999));
  EXPECT_TRUE(reader->given_up(10)->empty());
}

}  // namespace gapfarm::run_notes_test
