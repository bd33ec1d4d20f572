// Thousands of seeded fault schedules (GAPFARM_FARM_SCHEDULES: how many).  One alone:
// GAPFARM_FARM_SEED=17 test_farm --gtest_filter=FaultSchedules.*
#include <gmock/gmock.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "tests/unit/farm/simulated_farm.h"

namespace gapfarm::fault_schedule_test {

using ::testing::HasSubstr;

constexpr std::uint64_t kSchedules = 10000;

bool is_fatal(const std::string& payload) { return payload == "crash" || payload == "hang"; }

std::vector<v1::Task> tasks_for(std::uint64_t seed, bool with_fatal) {
  std::mt19937_64 random(seed);
  std::vector<v1::Task> tasks(1 + random() % 24);
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    tasks[i].mutable_echo()->set_payload("task " + std::to_string(i));
    tasks[i].mutable_echo()->set_busy_us(1000 + random() % 300000);
  }
  // Now and then one that takes far longer than the others.
  if (random() % 4 == 0) tasks[random() % tasks.size()].mutable_echo()->set_busy_us(2500000);
  if (with_fatal) {
    tasks[random() % tasks.size()].mutable_echo()->set_payload(seed % 2 != 0 ? "crash" : "hang");
  }
  return tasks;
}

FaultPlan faults_for(std::uint64_t seed) {
  std::mt19937_64 random(seed + 1000003);
  FaultPlan faults;
  faults.drop = 0.1 * static_cast<double>(random() % 3);
  faults.duplicate = 0.1 * static_cast<double>(random() % 3);
  faults.delay_s = random() % 3 == 0 ? 0.1 : 0.002;
  faults.deaths = random() % 6;
  faults.hangs = random() % 3;
  faults.drains = random() % 3;
  faults.partitions = random() % 3;
  faults.master_pauses = random() % 2;
  faults.master_restarts = random() % 3 == 0 ? 1 + random() % 2 : 0;
  faults.lifetime_s = random() % 4 == 0 ? 4 : 0;
  faults.audit_share = random() % 2 == 0 ? 0.2 : 0.0;
  faults.mistaken = random() % 4 == 0 ? 0.1 : 0.0;
  return faults;
}

// What is wrong with the schedule; empty: nothing.
std::string trouble_of(std::uint64_t seed) {
  const bool with_fatal = seed % 5 == 0;
  const std::vector<v1::Task> tasks = tasks_for(seed, with_fatal);
  SimulatedFarm farm(seed, 1 + seed % 4, faults_for(seed));
  const std::size_t batches = 1 + seed % 3 / 2;
  const std::vector<v1::TaskResult> results = farm.run(tasks, batches);
  if (results.size() != tasks.size()) return "did not end";
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const std::string& payload = tasks[i].echo().payload();
    const bool right = is_fatal(payload) ? results[i].outcome() == v1::WORKER_FAILED
                                         : results[i].echo() == payload;
    if (!right) return "wrong result for task " + std::to_string(i);
  }
  const std::size_t last = tasks.size() - (batches - 1) * tasks.size() / batches;
  if (farm.answers_taken() != last) {
    return std::to_string(farm.answers_taken()) + " answers were taken for " +
           std::to_string(last) + " tasks";
  }
  if (farm.scheduler().tally().alarms != 0) return "a false alarm";
  return "";
}

// The same for tasks that are added one by one as answers come in.
std::string trouble_of_stream(std::uint64_t seed) {
  constexpr std::size_t kTasks = 60;
  FaultPlan faults = faults_for(seed);
  faults.master_restarts = 0;
  std::vector<v1::Task> tasks(kTasks);
  std::mt19937_64 random(seed);
  for (std::size_t i = 0; i < kTasks; ++i) {
    tasks[i].mutable_echo()->set_payload(i == 7 && seed % 5 == 0 ? "crash" : std::to_string(i));
    tasks[i].mutable_echo()->set_busy_us(1000 + random() % 300000);
  }
  SimulatedFarm farm(seed, 1 + seed % 4, faults);
  std::size_t next = 1 + seed % 6;
  std::vector<unsigned> answers(kTasks);
  std::string trouble;
  const auto take = [&](std::size_t place, const v1::TaskResult& result) {
    const std::string& payload = tasks.at(place).echo().payload();
    ++answers[place];
    const bool right =
        is_fatal(payload) ? result.outcome() == v1::WORKER_FAILED : result.echo() == payload;
    if (!right) trouble = "wrong result for task " + payload;
    std::vector<v1::Task> more;
    for (std::size_t i = random() % 3; i > 0 && next < kTasks; --i) more.push_back(tasks[next++]);
    if (more.empty() && farm.scheduler().finished() && next < kTasks) more = {tasks[next++]};
    return Result<std::vector<v1::Task>>(std::move(more));
  };
  const auto first = tasks.begin() + static_cast<std::ptrdiff_t>(next);
  if (!farm.stream({tasks.begin(), first}, take)) return "did not end";
  if (answers != std::vector<unsigned>(kTasks, 1)) return "not one answer a task";
  if (farm.scheduler().tally().alarms != 0) return "a false alarm";
  return trouble;
}

std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

TEST(FaultSchedules, LoseNothingCommitNothingTwiceAndEnd) {
  const std::uint64_t alone = number_from("GAPFARM_FARM_SEED", 0);
  const std::uint64_t first = alone != 0 ? alone : 1;
  const std::uint64_t last = alone != 0 ? alone : number_from("GAPFARM_FARM_SCHEDULES", kSchedules);
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    ASSERT_EQ(trouble_of(seed), "")
        << "replay: GAPFARM_FARM_SEED=" << seed << " test_farm --gtest_filter=FaultSchedules.*";
  }
}

TEST(FaultSchedules, StreamsLoseNothingTakeNothingTwiceAndEnd) {
  for (std::uint64_t seed = 1; seed <= kSchedules / 10; ++seed) {
    ASSERT_EQ(trouble_of_stream(seed), "") << "seed " << seed;
  }
}

TEST(FaultSchedules, TheUndisturbedOneRetriesNothing) {
  FaultPlan none;
  none.delay_s = 0.001;
  none.span_s = 0;
  SimulatedFarm farm(1, 3, none);
  const auto tasks = tasks_for(3, false);
  ASSERT_EQ(farm.run(tasks).size(), tasks.size());
  EXPECT_EQ(farm.scheduler().tally().retries, 0u);
  EXPECT_EQ(farm.scheduler().tally().late, 0u);
  EXPECT_EQ(farm.scheduler().tally().foreign, 0u);
}

// Two workers, tasks of a millisecond, ten milliseconds there and back: whatever the way takes, it
// is hidden behind work, and no task is done twice for it.
TEST(FaultSchedules, TheWindowGrowsWithTheWayToTheMaster) {
  FaultPlan slow;
  slow.delay_s = 0.005;
  slow.span_s = 0;
  std::vector<v1::Task> tasks(8000);
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    tasks[i].mutable_echo()->set_payload(std::to_string(i));
    tasks[i].mutable_echo()->set_busy_us(1000);
  }
  SimulatedFarm farm(1, 2, slow);
  ASSERT_EQ(farm.run({tasks.begin(), tasks.begin() + 200}).size(), 200u);  // all have come
  const double began = farm.now();
  ASSERT_EQ(farm.run(tasks).size(), tasks.size());
  EXPECT_LT(farm.now() - began, 1.2 * 4.0) << "4 s is what two workers take that never wait";
  EXPECT_LT(farm.scheduler().tally().copies, 80u) << "a hundredth";
}

TEST(FaultSchedules, AuditsFindTheMachineThatComputesWrongly) {
  FaultPlan audits;
  audits.audit_share = 1;
  SimulatedFarm farm(1, 4, audits);
  farm.corrupt(3);
  farm.run(tasks_for(4, false));
  ASSERT_FALSE(farm.alarms().empty());
  EXPECT_EQ(farm.alarms().front().kind, FarmEvent::kDisagreement);
  // Audits go to another host, so one of the two is the wrong one, and both are named.
  for (const FarmEvent& alarm : farm.alarms()) {
    EXPECT_THAT(alarm.text, HasSubstr("host-1"));
    EXPECT_THAT(alarm.text, HasSubstr("host-0"));
  }
}

TEST(FaultSchedules, AQuarantineNamesTheTaskAndThreeWorkers) {
  FaultPlan none;
  none.span_s = 0;
  SimulatedFarm farm(5, 4, none);
  std::vector<v1::Task> tasks = tasks_for(5, false);
  tasks[0].mutable_echo()->set_payload("hang");
  ASSERT_EQ(farm.run(tasks)[0].outcome(), v1::WORKER_FAILED);
  ASSERT_EQ(farm.alarms().size(), 1u);
  EXPECT_THAT(farm.alarms()[0].text, HasSubstr("echo of 'hang' was given up: worker-"));
  EXPECT_THAT(farm.alarms()[0].text, HasSubstr("host-0 hung"));
  EXPECT_THAT(farm.alarms()[0].text, HasSubstr("host-1 hung"));
}

}  // namespace gapfarm::fault_schedule_test
