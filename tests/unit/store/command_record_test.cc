#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/base/build_info.h"
#include "master/store/answer_store.h"
#include "master/store/records.h"
#include "master/store/run_lock.h"
#include "tests/unit/store/store_fixture.h"

namespace gapfarm::command_record_test {

using testing::HasSubstr;

class CommandRecordTest : public StoreTest {
 protected:
  static CommandRecord example() {
    CommandRecord record;
    record.command = "compare";
    record.arguments = "gapfarm compare a.toml --out compared";
    record.state = RunState::kRunning;
    record.stage = "evaluate";
    record.number = record.stages = 1;
    record.done = 10;
    record.total = 40;
    record.share = 0.25;
    record.time_left_s = 30;
    record.waiting = "waiting for workers";
    record.workers = {{"local-1", "here", "busy", 2, 10, 5.0}};
    record.heartbeat_unix_s = 1000;
    record.pid = 7;
    record.host = host_name();
    return record;
  }
  void write(const CommandRecord& record) const {
    auto store = AnswerStore::open(answer_file(folder_), "build");
    ASSERT_TRUE(store.ok());
    ASSERT_TRUE(store->set_command(to_json(record).dump()).ok());
  }
};

TEST_F(CommandRecordTest, ALiveCommandIsWhatItReported) {
  write(example());
  const auto lock = RunLock::take(folder_);
  ASSERT_TRUE(lock.ok());
  const auto record = command_status(folder_, 1e6);
  ASSERT_TRUE(record.ok() && *record);
  EXPECT_EQ(to_json(**record), to_json(example()))
      << "however old its last word: it holds the lock";
}

TEST_F(CommandRecordTest, KeepsItsStagesAndWhatWasFoundInThem) {
  CommandRecord record = example();
  record.plan = {{"tune", 100}, {"screen", 0}};
  record.findings = {{"tune", {"the noise", "12 \"mm\".", {"noise", "size"}, {{"a", "1 mm"}}}},
                     {"tune", {"where", "", {}, {}}}};
  const CommandRecord back = command_record_of(to_json(record));
  ASSERT_EQ(back.plan.size(), 2u);
  EXPECT_EQ(back.plan[0].name, "tune");
  EXPECT_EQ(back.plan[0].began_unix_s, 100);
  ASSERT_EQ(back.findings.size(), 2u);
  EXPECT_EQ(back.findings[0].stage, "tune");
  EXPECT_EQ(back.findings[0].found.text, "12 \"mm\".");
  EXPECT_EQ(back.findings[0].found.columns, record.findings[0].found.columns);
  EXPECT_EQ(back.findings[0].found.rows, record.findings[0].found.rows);
  EXPECT_TRUE(back.findings[1].found.rows.empty());
  // What another version wrote is omitted, not believed.
  auto json = to_json(record);
  json["findings"] = {1, {{"about", 3}, {"rows", {"x", {1, 2}}}}};
  json["plan"] = "none";
  EXPECT_EQ(command_record_of(json).findings.size(), 1u);
  EXPECT_TRUE(command_record_of(json).plan.empty());
}

TEST_F(CommandRecordTest, ADeadOneIsStoppedAndPromisesNothing) {
  write(example());
  const auto record = command_status(folder_, 1e6);
  ASSERT_TRUE(record.ok() && *record);
  EXPECT_EQ((*record)->state, RunState::kStopped);
  EXPECT_THAT((*record)->stop_reason, HasSubstr("crashed: process 7"));
  EXPECT_FALSE((*record)->time_left_s);
  EXPECT_TRUE((*record)->workers.empty());
  EXPECT_EQ((*record)->share, 0.25);
}

TEST_F(CommandRecordTest, OfAnotherHostTheHeartbeatDecides) {
  CommandRecord record = example();
  record.host = "elsewhere";
  write(record);
  EXPECT_EQ((*command_status(folder_, 1010))->state, RunState::kRunning);
  EXPECT_EQ((*command_status(folder_, 2000))->state, RunState::kStopped);
}

TEST_F(CommandRecordTest, FoldersWithoutACommandHaveNone) {
  EXPECT_FALSE((*command_status(folder_, 0)).has_value());
  ASSERT_TRUE(AnswerStore::open(answer_file(folder_), "build").ok());
  EXPECT_FALSE((*command_status(folder_, 0)).has_value()) << "of an older program";
}

TEST_F(CommandRecordTest, ForgettingTakesAnswersOutOfTheFileAndLeavesTheRecord) {
  auto store = AnswerStore::open(answer_file(folder_), "build");
  ASSERT_TRUE(store.ok());
  v1::Task task;
  task.mutable_echo()->set_payload("a telling word");
  v1::TaskResult result;
  ASSERT_TRUE(store->add_problem("hash", "problem").ok());
  ASSERT_TRUE(store->add("hash", "stage", {{store->key("hash", task), 1, task, result}}).ok());
  ASSERT_TRUE(store->set_command(to_json(example()).dump()).ok());
  ASSERT_TRUE(store->forget().ok());
  EXPECT_EQ(*store->count(), 0);
  std::ifstream file(answer_file(folder_), std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  EXPECT_EQ(bytes.find("a telling word"), bytes.npos);
  EXPECT_NE(bytes.find("compared"), bytes.npos);
}

// Its only worker has gone.
class EmptiedFarm : public Farm {
 public:
  std::string add_problem(const v1::Problem&) override { return {}; }
  Status stream(const std::string&, std::vector<v1::Task>, const TakeAnswer&,
                const OnProgress&) override {
    return {};
  }
  std::vector<WorkerStatus> workers() const override {
    return {{"local-1", "here", "gone", 0, 4, 0.0}};
  }
  std::vector<std::string> endpoints() const override { return {"tcp://here:5555"}; }
};

TEST(LiveStatusTest, WaitsForWorkersOnceAllHaveGone) {
  const EmptiedFarm farm;
  WorkerWait wait(farm.endpoints());
  LiveStatus status;
  status.listens(farm);
  EXPECT_EQ(status.listen, "tcp://here:5555");
  EXPECT_FALSE(status.look_at(farm, wait, 0)) << "they may be on their way";
  EXPECT_TRUE(status.look_at(farm, wait, 3));
  EXPECT_THAT(status.waiting, HasSubstr("waiting for workers at tcp://here:5555"));
  EXPECT_EQ(status.workers.size(), 1u);
  EXPECT_FALSE(status.look_at(farm, wait, 4)) << "nothing new";
}

}  // namespace gapfarm::command_record_test
