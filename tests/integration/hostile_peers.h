// Peers that mean harm, each in a thread of its own.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/net/keys.h"
#include "common/net/socket.h"

namespace gapfarm {

// Repeats one attack until it is destroyed.
class Attack {
 public:
  // `round` is called again and again; it must return within about a second.
  explicit Attack(std::function<void()> round);
  ~Attack();
  Attack(const Attack&) = delete;
  Attack& operator=(const Attack&) = delete;

  // Returns once `count` rounds are over.
  void wait_for_rounds(unsigned count) const;

 private:
  std::function<void()> round_;
  std::atomic<unsigned> rounds_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;  // last: it uses the rest
};

// A TCP connection to this machine's `port`, by hand.
class RawPeer {
 public:
  explicit RawPeer(int port);
  ~RawPeer();
  RawPeer(RawPeer&& other) noexcept;
  RawPeer& operator=(RawPeer&& other) noexcept;

  // As much as goes out before the peer closes or has not read for `timeout_ms`; bytes sent.
  std::size_t send(const std::string& bytes, int timeout_ms = 200);
  // Reads and drops what comes; true once the peer has closed.
  bool closed_within(int timeout_ms);

 private:
  int fd_;
};

// The first 64 bytes of ZMTP 3.0 with this mechanism.
std::string zmtp_greeting(const std::string& mechanism);

// One round each, against this machine's `port`.
void send_garbage(int port);
void send_oversize_handshake(int port);  // announces 60 MB in place of a HELLO, and sends them
void send_impossible_length(int port);   // announces 2^62 bytes
void greet_without_keys(int port);       // the NULL mechanism
void greet_byte_by_byte(int port);
void replay(int port, const std::string& recorded);

// Thousands of connections that never say a word; those that are closed are opened again.
class HalfOpen {
 public:
  HalfOpen(int port, std::size_t count) : port_(port), count_(count) {}
  void round();

 private:
  int port_;
  std::size_t count_;
  std::vector<RawPeer> peers_;
};

// What a client sends through one connection to the master, as an eavesdropper sees it.
class Recorder {
 public:
  // Listens on a port of its own and passes everything on to this machine's `master_port`.
  explicit Recorder(int master_port);
  ~Recorder();
  int port() const { return port_; }
  // Ends the recording.
  std::string stop();

 private:
  void run(int master_port);
  int listener_ = -1;
  int port_ = 0;
  int wake_[2] = {-1, -1};
  std::string bytes_;
  std::thread thread_;
};

}  // namespace gapfarm
