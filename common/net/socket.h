// ZeroMQ sockets as transports.  The one header behind which zmq.hpp hides.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/net/envelope.h"
#include "common/net/keys.h"

namespace gapfarm {

// Of the tcp:// connections that a listening socket accepts.  A stranger is one that has not yet
// got a message through the handshake.
struct LinkLimits {
  std::size_t connections = 16384;  // at most what the process may open, less a reserve
  std::size_t strangers = 1024;
  std::size_t stranger_bytes = std::size_t{16} << 20;  // that all strangers together have sent
};

struct LinkCounts {
  std::uint64_t accepted = 0;
  std::uint64_t refused_keys = 0;       // handshakes with a key that is not listed
  std::uint64_t failed_handshakes = 0;  // of any kind
  std::uint64_t dropped = 0;            // by LinkLimits
  std::size_t open = 0;                 // now
  std::size_t strangers = 0;            // now
};

struct SocketOptions {
  LinkSecurity security;  // of tcp:// links; ipc:// ones are private to this user
  LinkLimits limits;
  int queue_limit = 20000;      // messages a peer, each way
  double link_heartbeat_s = 2;  // ZMTP pings
  double link_timeout_s = 20;   // without an answer; below 65 s (the TTL is 16 bits of 0.1 s)
  double reconnect_min_s = 0.1;
  double reconnect_max_s = 5;
  double handshake_s = 10;
  double linger_s = 1;  // how long closing may take to get the last messages out
};

// Whether it is tcp://HOST:PORT, PORT being * or a number, or ipc://PATH.
Status check_endpoint(const std::string& endpoint);

// What RouterSocket::bind() would say of `endpoint` before it tries.  Errors: not an endpoint;
// tcp:// without keys, or open to more than this machine when `security` does not say so.
Status may_listen(const std::string& endpoint, const LinkSecurity& security);

// The master's side: many peers, named by ZeroMQ for each connection.
class RouterSocket : public Transport {
 public:
  static Result<std::unique_ptr<RouterSocket>> create(const SocketOptions& options = {});
  ~RouterSocket() override;

  // `endpoint`: tcp://HOST:PORT (HOST * or an address, PORT * for any) or ipc://PATH with a path of
  // at most 107 bytes.  May be called several times.  Returns the endpoint with the port filled in.
  // Errors: what may_listen() says; taken by another.
  Result<std::string> bind(const std::string& endpoint);

  SendStatus send(const std::string& peer, const std::string& bytes) override;
  // Messages of more than one part are dropped here: no worker of ours sends them.
  bool receive(Message* message) override;

  // Returns when a message may be there, one of `fds` is readable, a signal arrived or `timeout_s`
  // is over (negative: never).
  void wait(std::span<const int> fds, double timeout_s);

  LinkCounts link_counts() const;
  // Sentences about peers that were refused since the last call.
  std::vector<std::string> take_complaints();

 private:
  struct Impl;
  explicit RouterSocket(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// The worker's side: one peer, reconnected to with back-off and jitter for as long as it lives.
class DealerSocket : public Transport {
 public:
  // Errors: an endpoint that is none, or tcp:// without the keys that options.security lacks.
  static Result<std::unique_ptr<DealerSocket>> connect(const std::string& endpoint,
                                                       const SocketOptions& options = {});
  ~DealerSocket() override;

  // `peer` is ignored.  kBusy while no connection stands: nothing is queued for a master that may
  // never come.
  SendStatus send(const std::string& peer, const std::string& bytes) override;
  bool receive(Message* message) override;
  void wait(std::span<const int> fds, double timeout_s);

  // Why no connection comes about, when the peer has shown it since the last call; else empty.
  std::string take_trouble();

 private:
  struct Impl;
  explicit DealerSocket(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace gapfarm
