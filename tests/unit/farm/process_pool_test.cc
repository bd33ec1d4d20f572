#include "common/process/process_pool.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "common/base/clock.h"
#include "common/process/stop.h"
#include "master/farm/local_workers.h"
#include "tests/temporary_folder.h"

namespace gapfarm::process_pool_test {

ProcessPoolOptions shell(const std::string& script, std::vector<std::string>* replaced = nullptr) {
  ProcessPoolOptions options;
  options.program = "/bin/sh";
  options.name_prefix = "p";
  options.backoff_s = 0;
  options.arguments = [script, replaced](const std::string&, const ProcessEnded* end) {
    if (end != nullptr && replaced != nullptr) replaced->push_back(end->name);
    return std::vector<std::string>{"-c", script};
  };
  return options;
}

// Ends until nothing more happens, or `count` of them.
std::vector<ProcessEnded> collect(ProcessPool& pool, std::size_t count) {
  std::vector<ProcessEnded> ends;
  const double deadline = monotonic_seconds() + 20;
  while (ends.size() < count && !pool.exhausted() && monotonic_seconds() < deadline) {
    std::vector<pollfd> polled;
    for (int fd : pool.fds()) polled.push_back({fd, POLLIN, 0});
    poll(polled.data(), polled.size(), 1000);
    for (ProcessEnded& end : pool.reap(monotonic_seconds())) ends.push_back(std::move(end));
  }
  return ends;
}

TEST(ProcessPool, StartsAgainWhatEndsAndGivesUpInTime) {
  std::vector<std::string> replaced;
  ProcessPool pool(shell("kill -SEGV $$", &replaced));
  ASSERT_TRUE(pool.start(monotonic_seconds()).ok());
  const auto ends = collect(pool, 10);
  ASSERT_EQ(ends.size(), 3u);
  EXPECT_EQ(ends[0].cause, EndCause::kCrashed);
  EXPECT_NE(ends[0].text.find("signal 11"), std::string::npos);
  EXPECT_TRUE(ends[2].gave_up);
  EXPECT_TRUE(pool.exhausted());
  EXPECT_EQ(replaced, (std::vector<std::string>{"p-1.1", "p-1.2"}));
}

TEST(ProcessPool, ReportsHowAProcessEnded) {
  const auto cause_of = [](const std::string& script) {
    ProcessPool pool(shell(script));
    EXPECT_TRUE(pool.start(monotonic_seconds()).ok());
    return collect(pool, 1).at(0);
  };
  EXPECT_EQ(cause_of("exit 0").cause, EndCause::kLeft);
  EXPECT_EQ(cause_of("kill -TERM $$").cause, EndCause::kLeft);
  EXPECT_EQ(cause_of("kill -KILL $$").cause, EndCause::kKilled);
  EXPECT_EQ(cause_of("exit 1").cause, EndCause::kCrashed);
  EXPECT_TRUE(cause_of("exit 78").gave_up) << "refused for good";
}

TEST(ProcessPool, ReportsAProgramThatIsNotThere) {
  ProcessPoolOptions options = shell("");
  options.program = "/no/such/program";
  ProcessPool pool(options);
  const Status status = pool.start(monotonic_seconds());
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("/no/such/program"), std::string::npos);
}

TEST(ProcessPool, EndsItsChildren) {
  ProcessPoolOptions options = shell("exec sleep 1000");
  options.count = 3;
  ProcessPool pool(options);
  ASSERT_TRUE(pool.start(monotonic_seconds()).ok());
  EXPECT_EQ(pool.running(), 3u);
  pool.signal_all(SIGTERM);
  EXPECT_TRUE(pool.wait_all(20));
  EXPECT_EQ(pool.running(), 0u);
}

TEST(PrivateFolder, IsPrivateFitsASocketAndGoes) {
  setenv("TMPDIR", ("/" + std::string(120, 'x')).c_str(), 1);
  auto folder = PrivateFolder::make();
  unsetenv("TMPDIR");
  ASSERT_TRUE(folder.ok());
  const std::string socket = folder.value()->socket_path();
  EXPECT_LE(socket.size(), 107u);
  const std::string path = socket.substr(0, socket.rfind('/'));
  struct stat status = {};
  ASSERT_EQ(stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0700u);
  folder.value().reset();
  EXPECT_NE(stat(path.c_str(), &status), 0);
}

TEST(PrivateFolder, TakesThoseOfMastersThatWereKilledAlong) {
  const TemporaryFolder base;
  setenv("TMPDIR", base.path().c_str(), 1);
  const auto with_socket = [&](const char* name, bool listens, time_t age_s) {
    const std::string folder = base / name, path = folder + "/farm";
    mkdir(folder.c_str(), 0700);
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, path.size());
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    EXPECT_EQ(bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    if (listens) listen(fd, 1);
    const timespec when = {time(nullptr) - age_s, 0}, times[] = {when, when};
    utimensat(AT_FDCWD, path.c_str(), times, 0);
    return fd;
  };
  close(with_socket("gapfarm-killed", false, 3600));
  const int young = with_socket("gapfarm-begins", false, 0);
  const int alive = with_socket("gapfarm-living", true, 3600);
  const auto folder = PrivateFolder::make();
  unsetenv("TMPDIR");
  ASSERT_TRUE(folder.ok()) << folder.error().message;
  EXPECT_NE(access((base / "gapfarm-killed").c_str(), F_OK), 0);
  EXPECT_EQ(access((base / "gapfarm-begins/farm").c_str(), F_OK), 0);
  EXPECT_EQ(access((base / "gapfarm-living/farm").c_str(), F_OK), 0);
  close(young);
  close(alive);
}

// As of coreutils' timeout, which signals its child and then the group.
TEST(Stop, ASecondSigtermAtOnceIsTheSameRequest) {
  StopSource stop;
  const StopOnSignals signals(&stop);
  raise(SIGTERM);
  raise(SIGTERM);
  EXPECT_EQ(stop.requests(), 1u);
  raise(SIGINT);
  EXPECT_EQ(stop.requests(), 2u);
}

TEST(StopDeathTest, ASignalThatNobodyLooksForEndsTheProcess) {
  const auto interrupt = [](bool heeded, int times) {
    StopSource stop;
    const StopOnSignals signals(&stop, StopOnSignals::kSecondEnds);
    if (heeded) static_cast<void>(stop.requested());
    for (int i = 0; i < times; ++i) raise(SIGINT);
    _exit(0);
  };
  EXPECT_EXIT(interrupt(false, 1), testing::ExitedWithCode(128 + SIGINT), "");
  EXPECT_EXIT(interrupt(true, 1), testing::ExitedWithCode(0), "");
  EXPECT_EXIT(interrupt(true, 2), testing::ExitedWithCode(128 + SIGINT), "");
}

TEST(Stop, ASignalMakesTheDescriptorReadable) {
  StopSource stop;
  const StopOnSignals signals(&stop);
  raise(SIGTERM);
  EXPECT_EQ(stop.requests(), 1u);
  EXPECT_EQ(stop.signal(), SIGTERM);
  pollfd polled = {stop.fd(), POLLIN, 0};
  EXPECT_EQ(poll(&polled, 1, 0), 1);
  stop.acknowledge();
  EXPECT_EQ(poll(&polled, 1, 0), 0);
}

}  // namespace gapfarm::process_pool_test
