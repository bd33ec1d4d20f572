// Thousands of seeded fault schedules (GAPFARM_FARM_SCHEDULES: how many).  One alone:
// GAPFARM_FARM_SEED=17 test_farm --gtest_filter=FaultSchedules.*
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "tests/unit/farm/simulated_farm.h"

namespace gapfarm {
namespace {

std::vector<v1::Task> tasks_for(std::uint64_t seed, bool with_crasher) {
  std::mt19937_64 random(seed);
  std::vector<v1::Task> tasks(1 + random() % 40);
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    tasks[i].mutable_echo()->set_payload("task " + std::to_string(i));
    tasks[i].mutable_echo()->set_busy_us(1000 + random() % 300000);
  }
  if (with_crasher) tasks[random() % tasks.size()].mutable_echo()->set_payload("crash");
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
  faults.partitions = random() % 3;
  faults.master_pauses = random() % 2;
  faults.master_restarts = random() % 3 == 0 ? 1 + random() % 2 : 0;
  return faults;
}

// What is wrong with the schedule; empty: nothing.
std::string trouble_of(std::uint64_t seed) {
  const bool with_crasher = seed % 5 == 0;
  const std::vector<v1::Task> tasks = tasks_for(seed, with_crasher);
  SimulatedFarm farm(seed, 1 + seed % 4, faults_for(seed));
  const std::vector<v1::TaskResult> results = farm.run(tasks);
  if (results.size() != tasks.size()) return "did not end";
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const std::string& payload = tasks[i].echo().payload();
    const bool right = payload == "crash" ? results[i].outcome() == v1::WORKER_FAILED
                                          : results[i].echo() == payload;
    if (!right) return "wrong result for task " + std::to_string(i);
  }
  const std::uint64_t taken = farm.answers_taken() + farm.scheduler().counts().quarantined;
  if (taken != tasks.size()) return std::to_string(taken) + " answers were taken";
  return "";
}

TEST(FaultSchedules, LoseNothingCommitNothingTwiceAndEnd) {
  const char* alone = std::getenv("GAPFARM_FARM_SEED");
  const std::uint64_t first = alone != nullptr ? std::strtoull(alone, nullptr, 10) : 1;
  const char* count = std::getenv("GAPFARM_FARM_SCHEDULES");
  const std::uint64_t last = alone != nullptr   ? first
                             : count != nullptr ? std::strtoull(count, nullptr, 10)
                                                : 3000;
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    ASSERT_EQ(trouble_of(seed), "")
        << "replay: GAPFARM_FARM_SEED=" << seed << " test_farm --gtest_filter=FaultSchedules.*";
  }
}

TEST(FaultSchedules, TheUndisturbedOneRetriesNothing) {
  SimulatedFarm farm(1, 3, FaultPlan{0, 0, 0.001, 0, 0, 0, 0, 0, 0});
  const auto tasks = tasks_for(3, false);
  ASSERT_EQ(farm.run(tasks).size(), tasks.size());
  EXPECT_EQ(farm.scheduler().counts().retries, 0u);
  EXPECT_EQ(farm.scheduler().counts().late, 0u);
  EXPECT_EQ(farm.scheduler().counts().foreign, 0u);
}

}  // namespace
}  // namespace gapfarm
