// Logs, figures and replays of real runs.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "master/store/run_reader.h"
#include "tests/integration/demo_config.h"
#include "tests/integration/run_program.h"

namespace gapfarm::observability_test {

using nlohmann::json;
using testing::HasSubstr;

class Observability : public testing::Test {
 protected:
  std::vector<std::string> evolve(const std::string& run, std::vector<std::string> more) const {
    std::vector<std::string> arguments = {"evolve",      config_,         "--out",
                                          folder_ / run, "--generations", "3"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  TemporaryFolder folder_;
  const std::string config_ = folder_.write("run.toml", demo_config(8, 4));
};

std::vector<json> log_lines(const std::string& text) {
  std::vector<json> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    lines.push_back(json::parse(line, nullptr, false));
    EXPECT_TRUE(lines.back().is_object()) << line;
  }
  return lines;
}

// Empty: nobody is there.
std::string fetch(int port, const std::string& request) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  std::string answer;
  if (::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    ::close(fd);
    return answer;
  }
  EXPECT_GT(::send(fd, request.data(), request.size(), MSG_NOSIGNAL), 0);
  std::array<char, 4096> bytes;
  for (ssize_t n = 0; (n = ::recv(fd, bytes.data(), bytes.size(), 0)) > 0;) {
    answer.append(bytes.data(), static_cast<std::size_t>(n));
  }
  ::close(fd);
  return answer;
}

TEST_F(Observability, EveryLineOfAJsonLogIsAnObjectWithItsPlace) {
  const Finished run = gapfarm_command(
      evolve("run", {"--workers", "1", "--log-format", "json", "--log-level", "debug"}));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::size_t jobs = 0, generations = 0, joined = 0;
  for (const json& line : log_lines(run.err)) {
    EXPECT_TRUE(line.contains("time") && line.contains("level") && line.contains("text")) << line;
    const std::string text = line.value("text", "");
    if (text == "job answered") {
      EXPECT_EQ(line.value("run", ""), folder_ / "run") << line;
      ++jobs;
      EXPECT_GT(line.value("job", 0u), 0u);
      EXPECT_GT(line.value("attempt", 0u), 0u);
      EXPECT_NE(line.value("host", ""), "");
    }
    generations += text == "generation committed" && line.value("generation", 0u) > 0;
    joined += text.rfind("joined", 0) == 0 && line.value("worker", "") != "";
  }
  EXPECT_GE(jobs, 24u);
  EXPECT_EQ(generations, 3u);
  EXPECT_EQ(joined, 1u);
}

int port_after(const RunningProgram& program, const std::string& marker) {
  std::size_t at = std::string::npos;
  while (at == std::string::npos || program.err().find('\n', at) == std::string::npos) {
    if (program.ended()) throw std::runtime_error("ended without a port: " + program.err());
    at = program.err().find(marker);
    std::this_thread::yield();
  }
  return std::stoi(program.err().substr(at + marker.size()));
}

TEST_F(Observability, FiguresAreServedOnThisMachine) {
  RunningProgram master("gapfarm", evolve("run", {"--workers", "0", "--listen",
                                                  "ipc://" + folder_ / "farm", "--metrics", "0"}));
  const int port = port_after(master, "metrics: http://127.0.0.1:");
  const std::string close = " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
  std::string page;
  while (page.find("gapfarm_generation") == std::string::npos) {
    page = fetch(port, "GET /metrics" + close);
  }
  EXPECT_THAT(page, HasSubstr("200 OK"));
  const std::string of = "{of=\"" + folder_ / "run" + "\"";
  EXPECT_THAT(page, HasSubstr("\n# TYPE gapfarm_retries_total counter\n"));
  EXPECT_THAT(page, HasSubstr("\ngapfarm_retries_total" + of + "} 0\n"));
  EXPECT_THAT(page, HasSubstr("gapfarm_workers" + of + ",state=\"busy\"} 0\n"));
  EXPECT_THAT(fetch(port, "GET /etc/passwd" + close), HasSubstr("404"));
  EXPECT_THAT(fetch(port, "nonsense\r\n\r\n"), HasSubstr("400"));
  master.send(SIGTERM);
  master.wait();
}

// The page comes with the run and goes with it, however that ends.
TEST_F(Observability, APageComesAlong) {
  const std::string get = "GET /view?of=" + folder_ / "run" +
                          " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
  for (const int signal : {SIGTERM, SIGKILL}) {
    std::filesystem::remove_all(folder_ / "run");
    RunningProgram master("gapfarm",
                          evolve("run", {"--workers", "0", "--listen", "ipc://" + folder_ / "farm",
                                         "--page-port", "0"}));
    const int port = port_after(master, "page: http://127.0.0.1:");
    EXPECT_THAT(fetch(port, get), HasSubstr("No generation was completed yet"));
    EXPECT_THAT(master.err(), HasSubstr("ssh -L " + std::to_string(port)));
    master.send(signal);
    master.wait();
    // The kernel ends it when it learns of a killed parent.
    while (!fetch(port, get).empty()) std::this_thread::yield();
  }
  std::filesystem::remove_all(folder_ / "run");
}

TEST_F(Observability, APageOnATakenPortIsReported) {
  RunningProgram first("gapfarm", {"serve", folder_.path().string(), "--port", "0"});
  while (first.out().find("then open") == std::string::npos) std::this_thread::yield();
  const std::string marker = "127.0.0.1:";
  const int port = std::stoi(first.out().substr(first.out().find(marker) + marker.size()));
  const Finished run =
      gapfarm_command(evolve("run", {"--workers", "1", "--page-port", std::to_string(port)}));
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("cannot listen on 127.0.0.1:" + std::to_string(port)));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run"));
}

TEST_F(Observability, AnIndividualIsReplayedToTheBit) {
  ASSERT_EQ(gapfarm_command(evolve("run", {"--workers", "2"})).exit_code, 0);
  const auto reader = RunReader::open(folder_ / "run");
  ASSERT_TRUE(reader.ok()) << reader.error().message;
  const auto last = reader->individuals(3);
  ASSERT_TRUE(last.ok());
  ASSERT_FALSE(last->empty());
  const std::string file = folder_ / "paths.csv";
  for (const StoredIndividual& individual : {last->front(), last->back()}) {
    const std::vector<std::string> worker_arguments = {
        "replay", folder_ / "run", "--genome", std::to_string(individual.birth_id), "--paths",
        file,     "--force"};
    const Finished replay = gapfarm_command(worker_arguments);
    EXPECT_EQ(replay.exit_code, 0) << replay.out << replay.err;
    EXPECT_THAT(replay.out, HasSubstr("the same to the bit"));
  }
  // Without --force a file in the way is kept, whatever it is.
  const Finished taken =
      gapfarm_command({"replay", folder_ / "run", "--genome", "best", "--paths", file});
  EXPECT_EQ(taken.exit_code, 2);
  EXPECT_THAT(taken.err, HasSubstr("exists already"));
  const Finished best = gapfarm_command({"replay", folder_ / "run", "--genome", "best", "--json"});
  EXPECT_EQ(best.exit_code, 0) << best.err;
  EXPECT_THAT(best.out, HasSubstr("\"same\": true"));
  std::ifstream paths(folder_ / "paths.csv");
  std::string header, row;
  std::getline(paths, header);
  EXPECT_EQ(header, "session,trial,t,x,y,theta");
  EXPECT_TRUE(std::getline(paths, row));
  const Finished unknown = gapfarm_command({"replay", folder_ / "run", "--genome", "999999"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("999999"));
  const Finished beyond =
      gapfarm_command({"replay", folder_ / "run", "--genome", "best", "--generation", "999"});
  EXPECT_EQ(beyond.exit_code, 2);
  EXPECT_THAT(beyond.err, HasSubstr("--generation is 999, expected one of the run's, "));
}

}  // namespace gapfarm::observability_test
