#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "master/store/run_reader.h"
#include "tests/unit/store/store_fixture.h"

namespace gapfarm::run_status_test {

using ::testing::HasSubstr;

class RunStatusTest : public StoreTest {
 protected:
  RunStatus status(double later_s = 0) const {
    const Result<RunReader> reader = RunReader::open(run());
    EXPECT_TRUE(reader.ok());
    Result<RunStatus> result = run_status(*reader, reader->progress()->heartbeat_unix_s + later_s);
    EXPECT_TRUE(result.ok());
    return std::move(*result);
  }
};

TEST_F(RunStatusTest, IsRunningWhileTheMasterHoldsTheLock) {
  Result<RunStore> store = RunStore::create(run(), example_info());
  ASSERT_TRUE(store.ok());
  EXPECT_EQ(status().state, RunState::kRunning);
  EXPECT_EQ(status().last.generation, 0u);

  ASSERT_TRUE(store->commit(example_generation(1)).ok());
  Progress progress;
  progress.rate_per_s = 210;
  progress.time_left_s = 12;
  progress.workers = {{"w1", "here", "busy", 2, 40, 10}};
  ASSERT_TRUE(store->set_progress(progress).ok());
  // However long its last word is ago: it may sit in one long evaluation.
  const RunStatus now = status(3600);
  EXPECT_EQ(now.state, RunState::kRunning);
  EXPECT_EQ(now.rate_per_s, 210);
  EXPECT_EQ(now.time_left_s, 12);
  ASSERT_EQ(now.workers.size(), 1u);
  EXPECT_EQ(now.workers[0].finished, 40u);
}

TEST_F(RunStatusTest, ReportsACrashFromAnEnd) {
  {
    Result<RunStore> store = RunStore::create(run(), example_info());
    ASSERT_TRUE(store->commit(example_generation(1)).ok());
  }
  EXPECT_EQ(status().state, RunState::kStopped);
  EXPECT_THAT(status().stop_reason, HasSubstr("crashed"));
  {
    Result<RunStore> store = RunStore::open(run());
    Progress progress;
    progress.state = RunState::kFinished;
    progress.stop_reason = "generations: 1 of 1";
    ASSERT_TRUE(store->set_progress(progress).ok());
    EXPECT_EQ(status().state, RunState::kFinished);
  }
  EXPECT_EQ(status().state, RunState::kFinished);
  EXPECT_EQ(status().stop_reason, "generations: 1 of 1");
  EXPECT_EQ(status().time_left_s, 0);
  EXPECT_DOUBLE_EQ(status().rate_per_s, 3 / 0.5);
}

// A master on another host whose lock cannot be seen from here is judged by its heartbeat.
TEST_F(RunStatusTest, OfAKeptTailIsWhatItsMasterLeft) {
  {
    Result<RunStore> store = RunStore::create(run(), example_info());
    for (const std::uint64_t g : {1, 2}) ASSERT_TRUE(store->commit(example_generation(g)).ok());
    Progress end;
    end.state = RunState::kFinished;
    end.stop_reason = "completed";
    ASSERT_TRUE(store->set_progress(end).ok());
  }
  const auto backup = RunStore::open(run())->truncate_after(1);
  const auto kept = run_status(RunReader::open(*backup).value(), 0);
  EXPECT_EQ(kept->state, RunState::kFinished);
  EXPECT_EQ(kept->stop_reason, "completed");
}

TEST_F(RunStatusTest, TrustsAFreshHeartbeatOfAnotherHost) {
  { Result<RunStore> store = RunStore::create(run(), example_info()); }
  {
    Result<Database> database = Database::open(file(), Database::Mode::kWrite);
    ASSERT_TRUE(database->exec("UPDATE progress SET host = 'elsewhere'", "test").ok());
  }
  EXPECT_EQ(status(5).state, RunState::kRunning);
  EXPECT_EQ(status(120).state, RunState::kStopped);
}

TEST_F(RunStatusTest, JsonHasTheFieldsOfTheContract) {
  Result<RunStore> store = RunStore::create(run(), example_info());
  nlohmann::ordered_json json = to_json(status());
  EXPECT_TRUE(json["best_fitness"].is_null());
  EXPECT_EQ(json["digest"], "");
  const std::string digest = *store->commit(example_generation(1));
  Progress progress;
  progress.workers = {{"w1", "here", "busy", 3, 40, 12.5}};
  progress.farm.retries = 4;
  ASSERT_TRUE(store->set_progress(progress).ok());
  ASSERT_TRUE(store->add_incident(IncidentKind::kQuarantine, "evaluation of birth 7").ok());

  json = to_json(status());
  EXPECT_EQ(json["state"], "running");
  EXPECT_EQ(json["stop_reason"], "");
  EXPECT_EQ(json["generation"], 1);
  EXPECT_EQ(json["evaluations"], 3);
  EXPECT_EQ(json["best_fitness"], 1.0);
  EXPECT_EQ(json["mean_fitness"], 0.5);
  EXPECT_EQ(json["worst_fitness"], 0.0);
  EXPECT_EQ(json["digest"], digest);
  EXPECT_EQ(json["quarantined"], 1) << "of the generation in work";
  EXPECT_EQ(json["incidents"][0]["kind"], "quarantine");
  EXPECT_EQ(json["incidents"][0]["generation"], 2);
  EXPECT_EQ(json["incidents"][0]["text"], "evaluation of birth 7");
  EXPECT_EQ(json["farm"]["retries"], 4);
  EXPECT_EQ(json["farm"]["alarms"], 0);
  EXPECT_EQ(json["workers"][0]["rate_per_s"], 12.5);
  EXPECT_TRUE(json.contains("rate_per_s"));
  EXPECT_TRUE(json.contains("time_left_s"));
  EXPECT_EQ(json["workers"][0]["name"], "w1");
  EXPECT_EQ(json["workers"][0]["state"], "busy");
  EXPECT_EQ(json["workers"][0]["jobs"], 3);
  EXPECT_EQ(json["best"]["values"]["mass"], 0.35);
}

}  // namespace gapfarm::run_status_test
