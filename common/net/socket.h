// ZeroMQ sockets as transports.  The one header behind which zmq.hpp hides.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/net/transport.h"

namespace gapfarm {

struct SocketOptions {
  int queue_limit = 20000;      // messages a peer, each way
  double link_heartbeat_s = 2;  // ZMTP pings
  double link_timeout_s = 20;   // without an answer; below 65 s (the TTL is 16 bits of 0.1 s)
  double reconnect_min_s = 0.1;
  double reconnect_max_s = 5;
  double handshake_s = 10;
  double linger_s = 1;  // how long closing may take to get the last messages out
};

// The master's side: many peers, named by ZeroMQ for each connection.
class RouterSocket : public Transport {
 public:
  static Result<std::unique_ptr<RouterSocket>> create(const SocketOptions& options = {});
  ~RouterSocket() override;

  // `endpoint`: tcp://HOST:PORT (HOST * or an address, PORT * for any) or ipc://PATH with a path of
  // at most 107 bytes.  May be called several times.  Returns the endpoint with the port filled in.
  Result<std::string> bind(const std::string& endpoint);

  SendStatus send(const std::string& peer, const std::string& bytes) override;
  // Messages of more than one part are dropped here: no worker of ours sends them.
  bool receive(Message* message) override;

  // Returns when a message may be there, one of `fds` is readable, a signal arrived or `timeout_s`
  // is over (negative: never).
  void wait(std::span<const int> fds, double timeout_s);

 private:
  struct Impl;
  explicit RouterSocket(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// The worker's side: one peer, reconnected to with back-off and jitter for as long as it lives.
class DealerSocket : public Transport {
 public:
  static Result<std::unique_ptr<DealerSocket>> connect(const std::string& endpoint,
                                                       const SocketOptions& options = {});
  ~DealerSocket() override;

  // `peer` is ignored.  kBusy while no connection stands: nothing is queued for a master that may
  // never come.
  SendStatus send(const std::string& peer, const std::string& bytes) override;
  bool receive(Message* message) override;
  void wait(std::span<const int> fds, double timeout_s);

 private:
  struct Impl;
  explicit DealerSocket(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace gapfarm
