// gapfarm serve among clients that send garbage, say nothing, say it slowly, and are very many.
//   GAPFARM_SIEGE_REQUESTS=100000 GAPFARM_SIEGE_CONNECTIONS=3000 test_siege
// is the whole siege; without, a tenth and less of it.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "tests/integration/run_program.h"

namespace gapfarm::serve_siege_test {

using testing::HasSubstr;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMemoryIsTheProgramsOwn = false;  // a sanitizer keeps what was freed
#else
constexpr bool kMemoryIsTheProgramsOwn = true;
#endif
constexpr long kMostGrowth_kB = 20'000;

int from_environment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::atoi(text);
}

class Peer {
 public:
  explicit Peer(int port) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    there_ = fd_ >= 0 && ::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  ~Peer() { ::close(fd_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  bool there() const { return there_; }
  void send_bytes(const std::string& bytes) const {
    static_cast<void>(::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL));
  }
  std::string hear() const {
    std::string all;
    std::array<char, 4096> bytes;
    for (ssize_t n = 0; (n = ::recv(fd_, bytes.data(), bytes.size(), 0)) > 0;) {
      all.append(bytes.data(), static_cast<std::size_t>(n));
    }
    return all;
  }
  void end_sending() const { ::shutdown(fd_, SHUT_WR); }

 private:
  int fd_;
  bool there_ = false;
};

class Siege : public testing::Test {
 protected:
  Siege() : server_("gapfarm", {"serve", folder_.path().string(), "--port", "0"}) {
    rlimit limit = {};
    getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
    while (server_.out().find("then open") == std::string::npos) std::this_thread::yield();
    const std::string marker = "127.0.0.1:";
    port_ = std::stoi(server_.out().substr(server_.out().find(marker) + marker.size()));
    still_answers();
    before_kB_ = peak_kB();
  }

  // The most memory that the server ever had.
  long peak_kB() const {
    std::ifstream status("/proc/" + std::to_string(server_.pid()) + "/status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("VmHWM:")) return std::stol(line.substr(6));
    }
    return 0;
  }
  void still_answers() const {
    const Peer peer(port_);
    peer.send_bytes("GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
    const std::string page = peer.hear();
    EXPECT_THAT(page, testing::StartsWith("HTTP/1.1 200"));
    EXPECT_THAT(page, HasSubstr("</html>"));
  }
  void expect_connected(const std::string& what) const {
    const long peak = peak_kB();
    std::printf("%s: the server had at most %ld kB, %ld before\n", what.c_str(), peak, before_kB_);
    if (kMemoryIsTheProgramsOwn) {
      EXPECT_LT(peak - before_kB_, kMostGrowth_kB);
    }
  }

  TemporaryFolder folder_;
  RunningProgram server_;
  int port_ = 0;
  long before_kB_ = 0;
};

TEST_F(Siege, MalformedRequests) {
  const int requests = from_environment("GAPFARM_SIEGE_REQUESTS", 5000);
  std::mt19937 bits(14);
  const std::array<std::string, 5> seeds = {
      "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
      "GET /view?of=%41&of=b HTTP/1.0\r\nHost: [::1]:1\r\n\r\n",
      "POST /x HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nffffff\r\nabc",
      "GET /events?at=/ HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 99999999999\r\n\r\n",
      "\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03 no HTTP at all\r\n\r\n"};
  for (int i = 0; i < requests; ++i) {
    std::string bytes = seeds[bits() % seeds.size()];
    for (unsigned k = bits() % 6; k > 0; --k) {
      bytes[bits() % bytes.size()] = static_cast<char>(bits() % 256);
    }
    if (i % 50 == 0) bytes.insert(bytes.size() / 2, 20000, 'x');  // beyond every limit
    const Peer peer(port_);
    ASSERT_TRUE(peer.there()) << "after " << i;
    peer.send_bytes(bytes.substr(0, bits() % (bytes.size() + 1)));
    if (i % 2 == 0) peer.end_sending();
    if (i % 4 == 0) peer.hear();
  }
  still_answers();
  expect_connected(std::to_string(requests) + " malformed requests");
}

TEST_F(Siege, ManyConnectionsThatReportNothingOrALittle) {
  const int connections = from_environment("GAPFARM_SIEGE_CONNECTIONS", 600);
  std::vector<std::unique_ptr<Peer>> peers;
  for (int i = 0; i < connections; ++i) {
    peers.push_back(std::make_unique<Peer>(port_));
    ASSERT_TRUE(peers.back()->there()) << "after " << i;
    if (i % 2 == 0) peers.back()->send_bytes("GET / HTTP/1.1\r\nHo");
    if (i % 5 == 0) peers.back()->send_bytes("st: localhost\r\nX: ");
  }
  still_answers();
  // A byte now and then from each.
  for (int round = 0; round < 5; ++round) {
    for (const auto& peer : peers) peer->send_bytes("x");
    still_answers();
  }
  expect_connected(std::to_string(connections) + " connections");
}

// Whoever asks for a page and does not take it.
TEST_F(Siege, PagesThatNobodyTakes) {
  const int connections = from_environment("GAPFARM_SIEGE_CONNECTIONS", 600);
  std::vector<std::unique_ptr<Peer>> peers;
  for (int i = 0; i < connections; ++i) {
    peers.push_back(std::make_unique<Peer>(port_));
    for (int k = 0; k < 4; ++k) {
      peers.back()->send_bytes("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
    }
    if (i % 3 == 0)
      peers.back()->send_bytes("GET /events?at=/ HTTP/1.1\r\nHost: localhost\r\n\r\n");
  }
  still_answers();
  expect_connected(std::to_string(connections) + " connections that take nothing");
}

}  // namespace gapfarm::serve_siege_test
