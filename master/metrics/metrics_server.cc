#include "master/metrics/metrics_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>

namespace gapfarm {
namespace {

constexpr int kPatience_ms = 1000;
constexpr std::size_t kRequestLimit = 4096;

bool readable(int fd, int timeout_ms) {
  pollfd polled = {fd, POLLIN, 0};
  return ::poll(&polled, 1, timeout_ms) > 0;
}

// Up to the empty line that ends a request without a body.
std::string read_request(int client) {
  std::string request;
  std::array<char, 1024> bytes;
  while (request.size() < kRequestLimit && request.find("\r\n\r\n") == std::string::npos) {
    if (!readable(client, kPatience_ms)) break;
    const ssize_t n = ::recv(client, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (n <= 0) break;
    request.append(bytes.data(), static_cast<std::size_t>(n));
  }
  return request;
}

void send_all(int client, const std::string& bytes) {
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    pollfd polled = {client, POLLOUT, 0};
    if (::poll(&polled, 1, kPatience_ms) <= 0) return;
    const ssize_t n =
        ::send(client, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n <= 0) return;
    sent += static_cast<std::size_t>(n);
  }
}

}  // namespace

MetricsServer::MetricsServer(int listener, int wake, unsigned port)
    : listener_(listener), wake_(wake), port_(port), thread_([this] { run(); }) {}

Result<std::unique_ptr<MetricsServer>> MetricsServer::listen(unsigned port) {
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  socklen_t size = sizeof address;
  const bool bound = ::bind(listener, reinterpret_cast<sockaddr*>(&address), size) == 0 &&
                     ::listen(listener, 16) == 0 &&
                     ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) == 0;
  if (!bound) {
    const Error error{"cannot serve metrics on 127.0.0.1:" + std::to_string(port) + ": " +
                      strerror(errno) + "; take another port with --metrics"};
    ::close(listener);
    return error;
  }
  return std::unique_ptr<MetricsServer>(
      new MetricsServer(listener, ::eventfd(0, EFD_CLOEXEC), ntohs(address.sin_port)));
}

MetricsServer::~MetricsServer() {
  const std::uint64_t one = 1;
  if (::write(wake_, &one, sizeof one) < 0) std::terminate();
  thread_.join();
  ::close(listener_);
  ::close(wake_);
}

void MetricsServer::publish(std::string page) {
  const std::lock_guard lock(mutex_);
  page_ = std::move(page);
}

void MetricsServer::run() {
  std::array<pollfd, 2> polled = {pollfd{wake_, POLLIN, 0}, pollfd{listener_, POLLIN, 0}};
  for (;;) {
    ::poll(polled.data(), polled.size(), -1);
    if ((polled[0].revents & POLLIN) != 0) return;
    const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (client < 0) continue;
    answer(client);
    ::close(client);
  }
}

void MetricsServer::answer(int client) {
  const std::string request = read_request(client);
  const std::string line = request.substr(0, request.find("\r\n"));
  const bool known = line.rfind("GET /metrics ", 0) == 0 || line.rfind("GET / ", 0) == 0;
  std::string page = "only GET /metrics is here\n";
  if (known) {
    const std::lock_guard lock(mutex_);
    page = page_;
  }
  send_all(client, std::string("HTTP/1.1 ") + (known ? "200 OK" : "404 Not Found") +
                       "\r\nContent-Type: text/plain; version=0.0.4\r\nContent-Length: " +
                       std::to_string(page.size()) + "\r\nConnection: close\r\n\r\n" + page);
}

void MetricsPage::head(const std::string& name, Type type, const std::string& help) {
  if (name == last_) return;
  last_ = name;
  text_ += "# HELP gapfarm_" + name + " " + help + "\n# TYPE gapfarm_" + name +
           (type == kGauge ? " gauge\n" : " counter\n");
}

namespace {

std::string number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.17g", value);
  return text.data();
}

}  // namespace

void MetricsPage::add(const std::string& name, Type type, const std::string& help, double value) {
  head(name, type, help);
  text_ += "gapfarm_" + name + " " + number(value) + "\n";
}

void MetricsPage::add_labelled(const std::string& name, Type type, const std::string& help,
                               const std::string& label, const std::string& label_value,
                               double value) {
  head(name, type, help);
  text_ += "gapfarm_" + name + "{" + label + "=\"" + label_value + "\"} " + number(value) + "\n";
}

}  // namespace gapfarm
