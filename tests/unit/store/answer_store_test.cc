#include "master/store/answer_store.h"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/immediate_farm.h"
#include "tests/unit/store/store_fixture.h"

namespace gapfarm::answer_store_test {

using testing::HasSubstr;

v1::Task echo(const std::string& payload) {
  v1::Task task;
  task.mutable_echo()->set_payload(payload);
  return task;
}

// Answers with the payload, counts what it is asked, and stops when commanded to.
class EchoFarm : public tests::ImmediateFarm {
 public:
  std::string add_problem(const v1::Problem&) override { return "hash"; }

  std::vector<std::string> asked;
  bool stopped = false;
  std::string stop_at;  // a payload

 protected:
  Result<v1::TaskResult> answer_task(const std::string&, const v1::Task& task) override {
    const std::string& payload = task.echo().payload();
    if (stopped || payload == stop_at) return stop_requested();
    asked.push_back(payload);
    v1::TaskResult result;
    result.set_outcome(payload == "bad worker" ? v1::WORKER_FAILED : v1::OK);
    result.set_echo(payload);
    return result;
  }
};

class AnswerStoreTest : public StoreTest {
 protected:
  std::filesystem::path answers() const { return folder_ / "simulations.sqlite"; }
};

TEST_F(AnswerStoreTest, AFarmIsAskedOnlyOnceAndAnswersKeepTheirOrder) {
  const auto farm = std::make_shared<EchoFarm>();
  for (const bool again : {false, true}) {
    auto store = AnswerStore::open(answers(), "build");
    ASSERT_TRUE(store.ok()) << store.error().message;
    RecordedFarm recorded(farm, &*store);
    const std::string hash = recorded.add_problem({});
    const auto first = recorded.run(hash, {echo("a"), echo("b")});
    ASSERT_TRUE(first.ok());
    const auto second = recorded.run(hash, {echo("c"), echo("b"), echo("a")});
    ASSERT_TRUE(second.ok());
    EXPECT_EQ((*second)[0].echo(), "c");
    EXPECT_EQ((*second)[1].echo(), "b");
    EXPECT_EQ((*second)[2].echo(), "a");
    EXPECT_EQ(recorded.simulated(), again ? 0u : 3u);
    EXPECT_EQ(recorded.remembered(), again ? 5u : 2u);
  }
  EXPECT_THAT(farm->asked, testing::ElementsAre("a", "b", "c"));
}

TEST_F(AnswerStoreTest, AStopLosesNothingThatWasAnswered) {
  const auto farm = std::make_shared<EchoFarm>();
  auto store = AnswerStore::open(answers(), "build");
  ASSERT_TRUE(store.ok());
  RecordedFarm recorded(farm, &*store);
  const std::string hash = recorded.add_problem({});
  ASSERT_TRUE(recorded.run(hash, {echo("a")}).ok());
  farm->stopped = true;
  const auto stopped = recorded.run(hash, {echo("a"), echo("b")});
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::kStopped);
  EXPECT_TRUE(recorded.run(hash, {echo("a")}).ok()) << "no farm is needed for what is known";
}

// One batch may be the whole of a command's work.
TEST_F(AnswerStoreTest, AStopWithinABatchLosesNothingThatWasAnswered) {
  const auto farm = std::make_shared<EchoFarm>();
  auto store = AnswerStore::open(answers(), "build");
  ASSERT_TRUE(store.ok());
  farm->stop_at = "c";
  {
    RecordedFarm recorded(farm, &*store);
    const auto stopped = recorded.run(recorded.add_problem({}), {echo("a"), echo("b"), echo("c")});
    ASSERT_FALSE(stopped.ok());
    EXPECT_EQ(*store->count(), 2);
  }
  farm->stop_at.clear();
  RecordedFarm recorded(farm, &*store);
  RecordedProgress last;
  recorded.watch([&](const RecordedProgress& progress) { last = progress; });
  const auto whole = recorded.run(recorded.add_problem({}), {echo("a"), echo("b"), echo("c")});
  ASSERT_TRUE(whole.ok());
  EXPECT_EQ((*whole)[1].echo(), "b");
  EXPECT_THAT(farm->asked, testing::ElementsAre("a", "b", "c"));
  EXPECT_EQ(last.remembered, 2u);
  EXPECT_EQ(last.simulated, 1u);
  EXPECT_EQ(last.asked, 3u);
}

TEST_F(AnswerStoreTest, ALongBatchIsKeptAsItGoes) {
  static double now_s;
  now_s = 0;
  class SlowFarm : public EchoFarm {
   public:
    explicit SlowFarm(AnswerStore& store) : store_(store) {}
    std::vector<std::int64_t> kept;  // before each answer

   private:
    Result<v1::TaskResult> answer_task(const std::string& hash, const v1::Task& task) override {
      kept.push_back(*store_.count());
      now_s += 0.4;
      return EchoFarm::answer_task(hash, task);
    }
    AnswerStore& store_;
  };
  auto store = AnswerStore::open(answers(), "build");
  ASSERT_TRUE(store.ok());
  const auto farm = std::make_shared<SlowFarm>(*store);
  {
    RecordedFarm recorded(farm, &*store, [] { return now_s; });
    ASSERT_TRUE(
        recorded.run(recorded.add_problem({}), {echo("a"), echo("b"), echo("c"), echo("d")}).ok());
  }
  EXPECT_THAT(farm->kept, testing::ElementsAre(0, 0, 0, 3));
  EXPECT_EQ(*store->count(), 4);
}

TEST_F(AnswerStoreTest, OtherBuildsAndFailedWorkersAreNoAnswers) {
  const auto farm = std::make_shared<EchoFarm>();
  for (const char* build : {"one", "two"}) {
    auto store = AnswerStore::open(answers(), build);
    ASSERT_TRUE(store.ok());
    RecordedFarm recorded(farm, &*store);
    const std::string hash = recorded.add_problem({});
    ASSERT_TRUE(recorded.run(hash, {echo("a"), echo("bad worker")}).ok());
    ASSERT_TRUE(recorded.run(hash, {echo("a"), echo("bad worker")}).ok());
  }
  EXPECT_THAT(farm->asked, testing::ElementsAre("a", "bad worker", "bad worker", "a", "bad worker",
                                                "bad worker"));
}

TEST_F(AnswerStoreTest, FilesOfAnotherKindAreLeftAlone) {
  std::ofstream(answers()) << "no database at all, but long enough to be taken for a header....."
                              "................................................................";
  const auto text = AnswerStore::open(answers(), "build");
  ASSERT_FALSE(text.ok());
  EXPECT_THAT(text.error().message, HasSubstr(answers().string()));
  std::filesystem::remove(answers());
  {
    auto other = Database::open(answers(), Database::Mode::kCreate);
    ASSERT_TRUE(other.ok());
    ASSERT_TRUE(other->exec("CREATE TABLE mine (x); PRAGMA application_id = 7", "try").ok());
  }
  const auto foreign = AnswerStore::open(answers(), "build");
  ASSERT_FALSE(foreign.ok());
  EXPECT_THAT(foreign.error().message, HasSubstr("another kind (application id 7"));
}

}  // namespace gapfarm::answer_store_test
