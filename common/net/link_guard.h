// Who may talk to a listening socket, and how many at once.  Internal to common/net.
//
// ZeroMQ limits neither connections nor what a peer may send before it has proved who it is, so the
// guard watches every tcp:// connection that is accepted.  Until its first message has come through
// the handshake a connection is a stranger; strangers are few, send little, and give way.
#pragma once

#include <memory>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>
#include <zmq.hpp>

#include "common/net/keys.h"
#include "common/net/socket.h"

namespace gapfarm {

inline constexpr const char* kZapDomain = "gapfarm";
inline constexpr const char* kOpenDomain = "gapfarm-open";  // of endpoints without keys

// The allow-list of worker keys (ZAP, RFC 27): asked once a handshake, read again when it may have
// changed, empty when it cannot be read.
class AllowList {
 public:
  explicit AllowList(std::string folder) : folder_(std::move(folder)) {}
  // Name of the worker whose public key (Z85) this is; null: not listed.  Reads the folder again
  // when that was done before `now` - 1 s.
  const std::string* find(const std::string& key, double now);

 private:
  std::string folder_;
  double read_ = -1e9;
  std::unordered_map<std::string, std::string> names_;  // by key
};

class LinkGuard {
 public:
  // Watches `router`, which binds afterwards and outlives the guard.
  LinkGuard(zmq::context_t& context, zmq::socket_t& router, const LinkSecurity& security,
            const LinkLimits& limits);
  ~LinkGuard();
  LinkGuard& operator=(LinkGuard&&) = delete;

  // From the socket's thread: a message came in over this connection.
  void heard(const zmq::message_t& message);

  LinkCounts counts() const;
  // Sentences about refused peers since the last call; the same key is named once a
  // minute.
  std::vector<std::string> take_complaints();

 private:
  struct Shared;
  class Watch;
  std::unique_ptr<Shared> shared_;
  zmq::socket_t& router_;
  std::thread thread_;
};

}  // namespace gapfarm
