// Real processes and sockets.  Waits on events only; ctest's timeout is the deadline.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/net/socket.h"
#include "tests/integration/farm_fixture.h"
#include "worker/service.h"

namespace gapfarm::farm_processes_test {

class LocalFarm : public testing::TestWithParam<unsigned> {};

TEST_P(LocalFarm, AnswersInOrderBatchAfterBatch) {
  auto farm = SocketFarm::create(local(GetParam()));
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  for (std::size_t count : {1u, 200u, 0u, 33u}) {
    const auto tasks = echo_tasks(count, 200);
    expect_echoes((*farm)->run("", tasks), tasks);
  }
  EXPECT_EQ((*farm)->tally().retries, 0u);
  EXPECT_EQ((*farm)->numeric_class(), "fake");
}

INSTANTIATE_TEST_SUITE_P(Workers, LocalFarm, testing::Values(1, 2, 4));

TEST(Farm, SurvivesKillNineInTheMiddleOfABatch) {
  auto farm = SocketFarm::create(local(2));
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  const auto tasks = echo_tasks(200, 5000);
  int killed = 0;
  expect_echoes((*farm)->run("", tasks,
                             [&](const FarmProgress& progress) {
                               if (progress.done < 10 || killed >= 3) return;
                               kill((*farm)->local_pids().at(0), SIGKILL);
                               ++killed;
                             }),
                tasks);
  EXPECT_EQ(killed, 3);
  EXPECT_GE((*farm)->tally().retries, 1u);  // some may have been killed empty-handed
}

TEST(Farm, QuarantinesATaskThatCrashesItsWorkers) {
  auto farm = SocketFarm::create(local(2));
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  auto tasks = echo_tasks(50);
  tasks[20].mutable_echo()->set_payload("crash");
  const auto results = (*farm)->run("", tasks);
  ASSERT_TRUE(results.ok()) << results.error().message;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    EXPECT_EQ((*results)[i].outcome(), i == 20 ? v1::WORKER_FAILED : v1::OK);
  }
}

TEST(Farm, WorkersFetchTheProblemByItsHash) {
  auto farm = SocketFarm::create(local(2));
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  std::vector<v1::Task> tasks(20);
  for (v1::Task& task : tasks) {
    task.mutable_evaluate()->mutable_point()->add_genome(0.5);
  }
  for (const char* scenario : {"one", "two", "one", "three", "four", "five", "one"}) {
    v1::Problem problem;
    problem.set_scenario(scenario);
    const auto results = (*farm)->run((*farm)->add_problem(problem), tasks);
    ASSERT_TRUE(results.ok());
    for (const v1::TaskResult& result : *results) {
      EXPECT_EQ(result.message(), scenario);
      EXPECT_EQ(result.evaluate().fitness(), 1.0);
    }
  }
  v1::Problem bad;
  bad.set_scenario("bad");
  for (const std::string& hash : {(*farm)->add_problem(bad), std::string("nobody knows")}) {
    const auto results = (*farm)->run(hash, tasks);
    ASSERT_TRUE(results.ok());
    for (const v1::TaskResult& result : *results) {
      EXPECT_EQ(result.outcome(), v1::INVALID_REQUEST);
    }
  }
}

TEST(Farm, ReportsWhenNoWorkerCanBeHad) {
  SocketFarmOptions options = local(2);
  options.worker_program = "/bin/false";
  auto farm = SocketFarm::create(options);
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  const auto results = (*farm)->run("", echo_tasks(3));
  ASSERT_FALSE(results.ok());
  EXPECT_NE(results.error().message.find("exited with status 1"), std::string::npos)
      << results.error().message;
}

TEST(Farm, AStopRequestInterruptsARunAndEndsTheWorkers) {
  StopSource stop;
  SocketFarmOptions options = local(2);
  options.stop = &stop;
  auto farm = SocketFarm::create(options);
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  auto tasks = echo_tasks(10, 600'000'000);
  tasks[0].mutable_echo()->set_busy_us(0);  // somebody is at work by then
  const double begun = monotonic_seconds();
  std::vector<int> pids;
  const auto results = (*farm)->run("", tasks, [&](const FarmProgress& progress) {
    if (progress.done == 0) return;
    pids = (*farm)->local_pids();
    stop.request();
  });
  ASSERT_FALSE(results.ok());
  EXPECT_EQ(results.error().code, ErrorCode::kStopped);
  farm->reset();
  EXPECT_LT(monotonic_seconds() - begun, 20);
  ASSERT_EQ(pids.size(), 2u);
  for (int pid : pids) EXPECT_NE(kill(pid, 0), 0);
}

TEST(Farm, RemoteWorkersJoinLateAndLeaveEarly) {
  std::unique_ptr<ProcessPool> first;
  std::unique_ptr<ProcessPool> second;
  SocketFarmOptions options = listening();
  int left = 0;
  options.on_event = [&](const FarmEvent& event) { left += event.kind == FarmEvent::kLeft; };
  auto farm = SocketFarm::create(options);
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  const std::string endpoint = (*farm)->endpoints().at(0);
  const auto tasks = echo_tasks(300, 3000);
  expect_echoes((*farm)->run("", tasks,
                             [&](const FarmProgress& progress) {
                               if (!first) first = remote_worker(endpoint);
                               if (progress.done > 20 && !second) second = remote_worker(endpoint);
                               if ((*farm)->workers().size() > 1) first->signal_all(SIGTERM);
                             }),
                tasks);
  EXPECT_EQ(left, 1);
  ASSERT_TRUE(second);
  second->signal_all(SIGTERM);
  EXPECT_TRUE(second->wait_all(20));
}

TEST(Farm, ARemoteWorkerServesOneMasterAfterTheOther) {
  std::unique_ptr<ProcessPool> worker;
  std::string endpoint = "tcp://127.0.0.1:*";
  const auto tasks = echo_tasks(50, 200);
  for (int life = 0; life < 3; ++life) {
    auto farm = SocketFarm::create(listening(endpoint));
    ASSERT_TRUE(farm.ok()) << farm.error().message;
    endpoint = (*farm)->endpoints().at(0);
    if (!worker) worker = remote_worker(endpoint);
    expect_echoes((*farm)->run("", tasks), tasks);
  }
}

TEST(Farm, RefusesAWorkerOfAnotherBuild) {
  StopSource stop;
  SocketFarmOptions options = listening();
  options.stop = &stop;
  options.on_event = [&](const FarmEvent& event) {
    if (event.kind == FarmEvent::kRefused) stop.request();
  };
  auto farm = SocketFarm::create(options);
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  ServiceOptions service;
  service.endpoint = (*farm)->endpoints().at(0);
  service.security.open = OpenLinks::kLoopback;
  service.session.hello.set_name("stranger");
  service.session.hello.set_fingerprint("another build");
  service.session.hello.set_numeric_class("fake");
  std::string refusal;
  std::thread worker([&] {
    StopSource own;
    EvaluationThread evaluation;
    const auto end = serve(service, evaluation, own);
    refusal = end ? "" : end.error().message;
  });
  EXPECT_FALSE((*farm)->run("", echo_tasks(1)).ok());
  worker.join();
  EXPECT_NE(refusal.find("another build"), std::string::npos) << refusal;
}

TEST(Farm, GarbageDoesNotDisturb) {
  SocketFarmOptions options = listening();
  options.local_workers = 2;
  auto farm = SocketFarm::create(options);
  ASSERT_TRUE(farm.ok()) << farm.error().message;
  const std::string endpoint = (*farm)->endpoints().at(0);
  // Bytes that are no ZeroMQ, and ZeroMQ messages that are no envelopes.
  const int raw = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port =
      htons(static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
  ASSERT_EQ(connect(raw, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  SocketOptions open;
  open.security.open = OpenLinks::kLoopback;
  auto rude = DealerSocket::connect(endpoint, open);
  ASSERT_TRUE(rude.ok());
  const auto tasks = echo_tasks(500, 1000);
  std::uint64_t reported = 0;
  expect_echoes((*farm)->run("", tasks,
                             [&](const FarmProgress&) {
                               const std::string noise(1000, static_cast<char>(reported * 37));
                               send(raw, noise.data(), noise.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
                               for (int i = 0; i < 100; ++i) {
                                 reported += (*rude)->send("", noise) == SendStatus::kSent;
                               }
                             }),
                tasks);
  close(raw);
  EXPECT_GT(reported, 0u);
  EXPECT_GT((*farm)->tally().malformed, 0u);
}

TEST(Farm, EndpointErrorsReportWhatToDo) {
  const auto message = [](const std::string& endpoint) {
    auto farm = SocketFarm::create(listening(endpoint));
    return farm ? std::string() : farm.error().message;
  };
  EXPECT_NE(message("tcp://127.0.0.1").find("HOST:PORT"), std::string::npos);
  EXPECT_NE(message("http://x:1").find("tcp://"), std::string::npos);
  EXPECT_NE(message("ipc://" + std::string(200, 'x')).find("107"), std::string::npos);
  auto first = SocketFarm::create(listening());
  ASSERT_TRUE(first.ok());
  EXPECT_NE(message((*first)->endpoints().at(0)).find("another master"), std::string::npos);
}

}  // namespace gapfarm::farm_processes_test
