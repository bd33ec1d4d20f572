// A server on a real port, and clients that are slow, broken or hostile.
#include "master/serve/http_server.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <random>
#include <thread>

#include "common/process/stop.h"

namespace gapfarm::http_server_test {

using testing::HasSubstr;
using testing::StartsWith;

// One connection that blocks.
class Client {
 public:
  explicit Client(std::uint16_t port) : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    connected_ =
        fd_ >= 0 && ::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  ~Client() { ::close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  bool connected() const { return connected_; }
  // Whether all of it was taken.
  bool send_bytes(const std::string& bytes) const {
    return ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }
  void end_sending() const { ::shutdown(fd_, SHUT_WR); }
  // Until it has reported `words`, or nothing more.
  std::string hear_until(const std::string& text) const {
    std::string all;
    char byte;
    while (all.find(text) == all.npos && ::recv(fd_, &byte, 1, 0) == 1) all += byte;
    return all;
  }
  // Until the other side has nothing more to say.
  std::string hear() const {
    std::string all;
    char bytes[4096];
    for (;;) {
      const ssize_t n = ::recv(fd_, bytes, sizeof bytes, 0);
      if (n <= 0) return all;
      all.append(bytes, static_cast<std::size_t>(n));
    }
  }

 private:
  int fd_;
  bool connected_ = false;
};

class Served : public testing::Test {
 protected:
  void start(const HttpLimits& limits) {
    auto server = HttpServer::listen(
        0,
        [this](const HttpRequest& request) {
          if (auto refused = refusal(request)) return *refused;
          if (request.target == "/events") {
            HttpResponse stream;
            stream.watched = [this] { return "state " + std::to_string(state_.load()); };
            return stream;
          }
          HttpResponse response = plain_response(200, "asked for " + request.target);
          response.etag = "\"one\"";
          if (request.if_none_match == response.etag) response.status = 304;
          return response;
        },
        limits);
    ASSERT_TRUE(server.ok()) << server.error().message;
    server_ = *std::move(server);
    thread_ = std::thread([this] { server_->run(stop_.fd()); });
  }
  void SetUp() override { start({}); }
  void TearDown() override { halt(); }
  void halt() {
    stop_.request();
    if (thread_.joinable()) thread_.join();
    stop_.acknowledge();
    server_.reset();
  }

  std::string ask(const std::string& bytes) const {
    const Client client(server_->port());
    EXPECT_TRUE(client.connected());
    client.send_bytes(bytes);
    return client.hear();
  }
  std::string get(const std::string& target) const {
    return ask("GET " + target + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  }
  void still_answers() const { EXPECT_THAT(get("/well"), HasSubstr("asked for /well")); }

  StopSource stop_;
  std::atomic<int> state_ = 1;
  std::unique_ptr<HttpServer> server_;
  std::thread thread_;
};

TEST_F(Served, AnswersWithPoliciesAndWithoutSharing) {
  const std::string answer = get("/a?b=1");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200 OK"));
  EXPECT_THAT(answer, HasSubstr("asked for /a?b=1"));
  EXPECT_THAT(answer, HasSubstr("X-Content-Type-Options: nosniff"));
  EXPECT_THAT(answer, HasSubstr("X-Frame-Options: DENY"));
  EXPECT_THAT(answer, testing::Not(HasSubstr("Access-Control-Allow")));
}

TEST_F(Served, SpeaksHttpTwiceOnAConnection) {
  const Client client(server_->port());
  client.send_bytes("GET /1 HTTP/1.1\r\nHost: localhost\r\n\r\n");
  client.send_bytes("HEAD /2 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
  const std::string both = client.hear();
  EXPECT_THAT(both, HasSubstr("asked for /1"));
  EXPECT_THAT(both, testing::Not(HasSubstr("asked for /2")));  // only how long it would be
  EXPECT_THAT(both, HasSubstr("Content-Length: 13\r\n"));
}

TEST_F(Served, ReportsThatNothingChanged) {
  const std::string answer = ask(
      "GET / HTTP/1.1\r\nHost: localhost\r\nIf-None-Match: \"one\"\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 304"));
  EXPECT_THAT(answer, testing::Not(HasSubstr("asked")));
}

TEST_F(Served, RefusesOtherMethodsAndHosts) {
  EXPECT_THAT(ask("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 3\r\n\r\nabc"),
              StartsWith("HTTP/1.1 413"));
  EXPECT_THAT(ask("DELETE / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"),
              StartsWith("HTTP/1.1 405"));
  for (const std::string host :
       {"Host: evil.example\r\n", "", "Host: localhost\r\nHost: evil\r\n"}) {
    EXPECT_THAT(ask("GET / HTTP/1.1\r\n" + host + "Connection: close\r\n\r\n"),
                StartsWith("HTTP/1.1 421"));
  }
}

TEST_F(Served, RefusesWhatIsTooLongOrGarbage) {
  EXPECT_THAT(
      ask("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(20000, 'x') + "\r\n\r\n"),
      testing::AnyOf(StartsWith("HTTP/1.1 431"), testing::IsEmpty()));
  EXPECT_THAT(ask("\x16\x03\x01 nonsense\r\n\r\n"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(
      ask("GET / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nffff\r\nabc"),
      testing::AnyOf(StartsWith("HTTP/1.1 4"), testing::IsEmpty()));
  still_answers();
}

TEST_F(Served, BearsManyMalformedRequests) {
  std::mt19937 bits(7);
  const std::string seeds[] = {"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
                               "HEAD /view?of=%41 HTTP/1.0\r\nHost: [::1]:1\r\n\r\n",
                               "POST /x HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n"};
  for (int i = 0; i < 3000; ++i) {
    std::string bytes = seeds[bits() % 3];
    for (int k = 0; k < 1 + i % 5; ++k) {
      bytes[bits() % bytes.size()] = static_cast<char>(bits() % 256);
    }
    const Client client(server_->port());
    client.send_bytes(bytes.substr(0, bits() % (bytes.size() + 1)));
    client.end_sending();
    if (i % 3 == 0) client.hear();  // the others hang up at once
  }
  still_answers();
}

// Whoever says nothing may neither keep others out nor stay for ever.
TEST_F(Served, SilentClientsGiveWay) {
  halt();
  HttpLimits limits;
  limits.connections = 8;
  limits.time = std::chrono::minutes(10);
  start(limits);
  std::vector<std::unique_ptr<Client>> silent;
  for (int i = 0; i < 100; ++i) {
    silent.push_back(std::make_unique<Client>(server_->port()));
    ASSERT_TRUE(silent.back()->connected());
    silent.back()->send_bytes("GET / HT");
  }
  still_answers();
  EXPECT_EQ(silent.front()->hear(), "");  // closed: it would wait for ten minutes otherwise
}

TEST_F(Served, SlowClientsAreHungUpOn) {
  halt();
  HttpLimits limits;
  limits.time = std::chrono::milliseconds(50);
  start(limits);
  const Client client(server_->port());
  client.send_bytes("GET / HTTP/1.1\r\nHo");
  EXPECT_EQ(client.hear(), "");
  still_answers();
}

constexpr const char* kListen = "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n";

TEST_F(Served, ReportsOfWhatIsNew) {
  halt();
  HttpLimits limits;
  limits.watch_interval = std::chrono::milliseconds(5);
  start(limits);
  const Client client(server_->port());
  client.send_bytes(kListen);
  const std::string head = client.hear_until("data: state 1\n\n");
  EXPECT_THAT(head, StartsWith("HTTP/1.1 200 OK"));
  EXPECT_THAT(head, HasSubstr("text/event-stream"));
  EXPECT_THAT(head, testing::Not(HasSubstr("Content-Length")));
  state_ = 2;
  EXPECT_THAT(client.hear_until("data: state 2\n\n"), HasSubstr("data: state 2\n\n"));
  EXPECT_THAT(client.hear_until(": still here\n\n"), testing::Not(HasSubstr("data")));
  still_answers();
}

TEST_F(Served, ReportsSoManyAndRefusesTheNext) {
  halt();
  HttpLimits limits;
  limits.streams = 2;
  limits.watch_interval = std::chrono::milliseconds(5);
  start(limits);
  const Client first(server_->port());
  {
    const Client second(server_->port());
    for (const Client* client : {&first, &second}) {
      client->send_bytes(kListen);
      EXPECT_THAT(client->hear_until("state 1"), HasSubstr("state 1"));
    }
    EXPECT_THAT(ask(kListen), StartsWith("HTTP/1.1 503"));
  }
  // The one that left has made room, as soon as the server knows.
  for (std::string answer = "HTTP/1.1 503"; answer.starts_with("HTTP/1.1 503");) {
    const Client third(server_->port());
    third.send_bytes(kListen);
    answer = third.hear_until("state 1");
  }
  still_answers();
}

// Streams count as connections, so they give way to others, too.
TEST_F(Served, StreamsGiveWayToNewConnections) {
  halt();
  HttpLimits limits;
  limits.connections = 4;
  start(limits);
  const Client stream(server_->port());
  stream.send_bytes(kListen);
  stream.hear_until("state 1");
  std::vector<std::unique_ptr<Client>> silent;
  for (int i = 0; i < 20; ++i) silent.push_back(std::make_unique<Client>(server_->port()));
  still_answers();
  stream.hear();  // ends
}

TEST_F(Served, ReportsWhenAPortIsTaken) {
  const auto second = HttpServer::listen(
      server_->port(), [](const HttpRequest&) { return plain_response(200, ""); });
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.error().message, HasSubstr("choose another --port"));
}

}  // namespace gapfarm::http_server_test
