// Farms of real processes and sockets, with workers that only echo.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/process/process_pool.h"
#include "common/process/stop.h"
#include "master/farm/socket_farm.h"

namespace gapfarm {

inline const char* const kWorkerProgram = GAPFARM_BIN_DIR "/gapfarm-fake-worker";

inline std::vector<v1::Task> echo_tasks(std::size_t count, std::uint64_t busy_us = 0) {
  std::vector<v1::Task> tasks(count);
  for (std::size_t i = 0; i < count; ++i) {
    tasks[i].mutable_echo()->set_payload("task " + std::to_string(i));
    tasks[i].mutable_echo()->set_busy_us(busy_us);
  }
  return tasks;
}

inline void expect_echoes(const Result<std::vector<v1::TaskResult>>& results,
                          const std::vector<v1::Task>& tasks) {
  ASSERT_TRUE(results.ok()) << results.error().message;
  ASSERT_EQ(results->size(), tasks.size());
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    EXPECT_EQ((*results)[i].outcome(), v1::OK);
    EXPECT_EQ((*results)[i].echo(), tasks[i].echo().payload());
  }
}

inline SocketFarmOptions quiet() {
  SocketFarmOptions options;
  options.worker_program = kWorkerProgram;
  options.on_event = [](const FarmEvent&) {};
  return options;
}

inline SocketFarmOptions local(unsigned workers) {
  SocketFarmOptions options = quiet();
  options.local_workers = workers;
  return options;
}

inline SocketFarmOptions listening(const std::string& endpoint = "tcp://127.0.0.1:*") {
  SocketFarmOptions options = quiet();
  options.listen = {endpoint};
  options.security.open = OpenLinks::kLoopback;
  return options;
}

// Workers as a user starts them, with these `words` on the command line; but a test that is killed
// takes them with it.
inline std::unique_ptr<ProcessPool> remote_worker(const std::string& endpoint,
                                                  const std::vector<std::string>& arguments = {
                                                      "--processes", "1"}) {
  ProcessPoolOptions options;
  options.program = "/usr/bin/setpriv";  // of util-linux
  options.name_prefix = "remote";
  options.limits = {0, 0};  // a supervisor has no page of its own
  options.arguments = [endpoint, arguments](const std::string&, const ProcessEnded*) {
    std::vector<std::string> all = {"--pdeathsig", "KILL",   kWorkerProgram,
                                    "--connect",   endpoint, "--insecure"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return all;
  };
  auto pool = std::make_unique<ProcessPool>(std::move(options));
  EXPECT_TRUE(pool->start(monotonic_seconds()).ok());
  return pool;
}

}  // namespace gapfarm
