// Workers that crash, hang, stop, run out of time or outlive their master, as real processes.
// Waits on events only; ctest's timeout is the deadline.
#include <gmock/gmock.h>
#include <signal.h>

#include "tests/integration/farm_fixture.h"

namespace gapfarm::farm_failures_test {

using ::testing::HasSubstr;
using ::testing::SizeIs;

void expect_given_up(const Result<std::vector<v1::TaskResult>>& results, std::size_t lost,
                     const std::string& why) {
  ASSERT_TRUE(results.ok()) << results.error().message;
  for (std::size_t i = 0; i < results->size(); ++i) {
    const v1::TaskResult& result = (*results)[i];
    ASSERT_EQ(result.outcome(), i == lost ? v1::WORKER_FAILED : v1::OK) << i;
    EXPECT_THAT(result.message(), HasSubstr(i == lost ? why : ""));
  }
}

TEST(FarmFailures, ATaskThatHangsIsKilledRetriedAndGivenUp) {
  SocketFarmOptions options = local(2);
  options.local_limits.progress_s = 0.4;
  std::vector<std::string> given_up;
  options.on_event = [&given_up](const FarmEvent& event) {
    if (event.kind == FarmEvent::kQuarantined) given_up.push_back(event.text);
  };
  auto farm = SocketFarm::create(options);
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  auto tasks = echo_tasks(50);
  tasks[20].mutable_echo()->set_payload("hang");
  expect_given_up((*farm)->run("", tasks), 20, "hung");
  EXPECT_GE((*farm)->tally().hung, 3u);  // a copy may hang, too
  ASSERT_THAT(given_up, SizeIs(1));
  EXPECT_THAT(given_up[0], HasSubstr("echo of 'hang'"));
}

TEST(FarmFailures, ARemoteWorkersOwnSupervisorDoesTheSame) {
  auto farm = SocketFarm::create(listening());
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  const auto workers =
      remote_worker((*farm)->endpoints().at(0), {"--processes", "2", "--progress-limit", "0.4"});
  for (const char* payload : {"hang", "crash"}) {
    auto tasks = echo_tasks(20);
    tasks[5].mutable_echo()->set_payload(payload);
    expect_given_up((*farm)->run("", tasks), 5,
                    std::string(payload) == "hang" ? "hung" : "crashed");
  }
  EXPECT_EQ((*farm)->given_up(), 2u);
}

TEST(FarmFailures, AStoppedWorkerIsReplacedAndNoTaskBlamed) {
  SocketFarmOptions options = local(2);
  options.local_limits.answer_s = 1.5;
  options.job_limits = {1, 1};
  auto farm = SocketFarm::create(options);
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  const auto tasks = echo_tasks(300, 5000);
  bool stopped = false;
  const auto results = (*farm)->run("", tasks, [&](const FarmProgress& progress) {
    if (progress.done < 10 || stopped) return;
    kill((*farm)->local_pids().at(0), SIGSTOP);
    stopped = true;
  });
  expect_echoes(results, tasks);
  ASSERT_TRUE(stopped);
  EXPECT_EQ((*farm)->given_up(), 0u);
}

TEST(FarmFailures, ACopyOvertakesTheWorkerThatIsStuck) {
  SocketFarmOptions options = local(2);
  options.copies.straggler_min_s = 0.05;
  auto farm = SocketFarm::create(options);
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  const auto warm = echo_tasks(50, 1000);
  expect_echoes((*farm)->run("", warm), warm);
  const auto tasks = echo_tasks(20, 20000);
  pid_t stopped = 0;
  const auto results = (*farm)->run("", tasks, [&](const FarmProgress& progress) {
    if (progress.done < 4 || stopped != 0) return;
    stopped = (*farm)->local_pids().at(0);
    kill(stopped, SIGSTOP);
  });
  expect_echoes(results, tasks);
  EXPECT_GE((*farm)->tally().copies, 1u);
  kill(stopped, SIGCONT);
}

TEST(FarmFailures, AuditsAgreeOnHonestMachines) {
  SocketFarmOptions options = local(2);
  options.copies.audit_share = 0.5;
  auto farm = SocketFarm::create(options);
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  for (int batch = 0; batch < 3; ++batch) {
    const auto tasks = echo_tasks(100, 500);
    expect_echoes((*farm)->run("", tasks), tasks);
  }
  EXPECT_GT((*farm)->tally().compared, 50u);
  EXPECT_EQ((*farm)->tally().alarms, 0u);
}

TEST(FarmFailures, DrainingFinishesWhatIsInHand) {
  int left = 0;
  SocketFarmOptions options = listening();
  options.window = 20;
  options.on_event = [&](const FarmEvent& event) { left += event.kind == FarmEvent::kLeft; };
  auto farm = SocketFarm::create(options);
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  const std::string endpoint = (*farm)->endpoints().at(0);
  auto drained = remote_worker(endpoint, {"--processes", "1", "--drain"});
  std::unique_ptr<ProcessPool> other;
  const auto tasks = echo_tasks(200, 3000);
  expect_echoes((*farm)->run("", tasks,
                             [&](const FarmProgress& progress) {
                               if (progress.done < 20 || other) return;
                               drained->signal_all(SIGTERM);
                               other = remote_worker(endpoint);
                             }),
                tasks);
  EXPECT_EQ(left, 1);
  EXPECT_EQ((*farm)->tally().late, 0u);
  EXPECT_TRUE(drained->wait_all(20));
}

TEST(FarmFailures, AWorkersLifetimeEndsBetweenJobs) {
  std::vector<std::string> farewells;
  SocketFarmOptions options = listening();
  options.on_event = [&](const FarmEvent& event) {
    if (event.kind == FarmEvent::kLeft) farewells.push_back(event.text);
  };
  auto farm = SocketFarm::create(options);
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  const std::string endpoint = (*farm)->endpoints().at(0);
  const auto brief = remote_worker(endpoint, {"--processes", "1", "--lifetime", "1.5"});
  std::unique_ptr<ProcessPool> other;
  const auto tasks = echo_tasks(20, 100000);
  expect_echoes((*farm)->run("", tasks,
                             [&](const FarmProgress&) {
                               if (!farewells.empty() && !other) other = remote_worker(endpoint);
                             }),
                tasks);
  ASSERT_FALSE(farewells.empty());
  EXPECT_THAT(farewells[0], HasSubstr("lifetime"));
  EXPECT_TRUE(brief->wait_all(20)) << "its supervisor goes, too";
}

// The first master is commanded to stop while a job is in work; the second asks the same question
// and need not wait for the job to be done again.
TEST(FarmFailures, FinishedWorkIsHandedToTheNextMaster) {
  StopSource stop;
  SocketFarmOptions options = listening();
  options.stop = &stop;
  options.epoch = 1;
  auto first = SocketFarm::create(options);
  ASSERT_TRUE(first.ok()) << first.error().message;
  options.stop = nullptr;
  options.listen = (*first)->endpoints();
  options.epoch = 2;
  const auto worker = remote_worker(options.listen.at(0));
  auto tasks = echo_tasks(3, 400000);
  tasks[0].mutable_echo()->set_busy_us(0);
  const auto none = (*first)->run("", tasks, [&](const FarmProgress& progress) {
    if (progress.done > 0) stop.request();
  });
  ASSERT_FALSE(none.ok());
  first->reset();
  auto second = SocketFarm::create(options);
  ASSERT_TRUE(second.ok()) << second.error().message;
  expect_echoes((*second)->run("", tasks), tasks);
  EXPECT_GE((*second)->tally().handed_over, 1u);
}

}  // namespace gapfarm::farm_failures_test
