#include "tests/integration/hostile_peers.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <random>
#include <utility>

namespace gapfarm {
namespace {

sockaddr_in local(int port) {
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int connect_to(int port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const sockaddr_in address = local(port);
  if (fd >= 0) (void)::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  return fd;
}

bool wait_fd(int fd, short events, int timeout_ms) {
  pollfd polled = {fd, events, 0};
  return ::poll(&polled, 1, timeout_ms) > 0;
}

}  // namespace

Attack::Attack(std::function<void()> round)
    : round_(std::move(round)), thread_([this] {
        while (!stop_) {
          round_();
          ++rounds_;
          rounds_.notify_all();
        }
      }) {}

Attack::~Attack() {
  stop_ = true;
  thread_.join();
}

void Attack::wait_for_rounds(unsigned count) const {
  for (unsigned seen = rounds_; seen < count; seen = rounds_) rounds_.wait(seen);
}

RawPeer::RawPeer(int port) : fd_(connect_to(port)) {}

RawPeer::~RawPeer() {
  if (fd_ >= 0) ::close(fd_);
}

RawPeer::RawPeer(RawPeer&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

RawPeer& RawPeer::operator=(RawPeer&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

std::size_t RawPeer::send(const std::string& bytes, int timeout_ms) {
  std::size_t sent = 0;
  while (sent < bytes.size() && wait_fd(fd_, POLLOUT, timeout_ms)) {
    const ssize_t n =
        ::send(fd_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n <= 0) break;
    sent += static_cast<std::size_t>(n);
  }
  return sent;
}

bool RawPeer::closed_within(int timeout_ms) {
  std::array<char, 4096> bytes;
  while (wait_fd(fd_, POLLIN, timeout_ms)) {
    if (::recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT) <= 0) return true;
  }
  return false;
}

std::string zmtp_greeting(const std::string& mechanism) {
  std::string greeting(64, '\0');
  greeting[0] = '\xff';
  greeting[9] = '\x7f';
  greeting[10] = 3;
  greeting.replace(12, mechanism.size(), mechanism);
  return greeting;
}

void send_garbage(int port) {
  static thread_local std::mt19937 random(1);
  std::string noise(10'000, '\0');
  for (char& c : noise) c = static_cast<char>(random());
  RawPeer peer(port);
  peer.send(noise);
  peer.closed_within(500);
}

namespace {

// A command frame with an eight-byte length.
std::string long_command(std::uint64_t length) {
  std::string frame(1, '\x06');
  for (int shift = 56; shift >= 0; shift -= 8) frame += static_cast<char>(length >> shift);
  return frame;
}

}  // namespace

void send_oversize_handshake(int port) {
  constexpr std::size_t kLength = std::size_t{60} << 20;
  const std::string chunk(1 << 20, 'x');
  RawPeer peer(port);
  peer.send(zmtp_greeting("CURVE") + long_command(kLength));
  for (std::size_t sent = 0; sent < kLength; sent += chunk.size()) {
    if (peer.send(chunk) < chunk.size()) return;
  }
}

void send_impossible_length(int port) {
  RawPeer peer(port);
  peer.send(zmtp_greeting("CURVE") + long_command(std::uint64_t{1} << 62));
  peer.closed_within(500);
}

void greet_without_keys(int port) {
  RawPeer peer(port);
  peer.send(zmtp_greeting("NULL") + std::string("\x04\x06\x05READY", 8));
  peer.closed_within(500);
}

void greet_byte_by_byte(int port) {
  RawPeer peer(port);
  const std::string greeting = zmtp_greeting("CURVE");
  for (std::size_t i = 0; i < 10; ++i) {
    peer.send(greeting.substr(i, 1));
    if (peer.closed_within(50)) return;
  }
}

void replay(int port, const std::string& recorded) {
  RawPeer peer(port);
  peer.send(recorded);
  peer.closed_within(200);
}

void HalfOpen::round() {
  std::erase_if(peers_, [](RawPeer& peer) { return peer.closed_within(0); });
  for (int i = 0; i < 500 && peers_.size() < count_; ++i) peers_.emplace_back(port_);
}

Recorder::Recorder(int master_port) : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = local(0);
  socklen_t size = sizeof address;
  ::bind(listener_, reinterpret_cast<sockaddr*>(&address), size);
  ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
  ::listen(listener_, 1);
  port_ = ntohs(address.sin_port);
  if (::pipe2(wake_, O_CLOEXEC) != 0) return;
  thread_ = std::thread([this, master_port] { run(master_port); });
}

void Recorder::run(int master_port) {
  std::array<pollfd, 3> polled = {pollfd{wake_[0], POLLIN, 0}, pollfd{listener_, POLLIN, 0},
                                  pollfd{-1, POLLIN, 0}};
  if (::poll(polled.data(), 2, -1) <= 0 || polled[0].revents != 0) return;
  const int client = ::accept(listener_, nullptr, nullptr);
  const int master = connect_to(master_port);
  polled[1].fd = client;
  polled[2].fd = master;
  std::array<char, 65536> bytes;
  while (::poll(polled.data(), polled.size(), -1) > 0 && polled[0].revents == 0) {
    for (const std::size_t from : {1, 2}) {
      if (polled[from].revents == 0) continue;
      const ssize_t n = ::recv(polled[from].fd, bytes.data(), bytes.size(), 0);
      if (n <= 0) {
        polled[0].revents = POLLIN;
        polled[from].fd = -1;
        continue;
      }
      if (from == 1) bytes_.append(bytes.data(), static_cast<std::size_t>(n));
      (void)::send(from == 1 ? master : client, bytes.data(), static_cast<std::size_t>(n),
                   MSG_NOSIGNAL);
    }
  }
  ::close(client);
  ::close(master);
}

std::string Recorder::stop() {
  if (thread_.joinable()) {
    (void)::write(wake_[1], "", 1);
    thread_.join();
  }
  return bytes_;
}

Recorder::~Recorder() {
  stop();
  for (int fd : {listener_, wake_[0], wake_[1]}) ::close(fd);
}

}  // namespace gapfarm
