#include "common/net/socket.h"

#include <sys/un.h>

#include <algorithm>
#include <cmath>
#include <zmq.hpp>

#include "common/net/envelope.h"

namespace gapfarm {
namespace {

int milliseconds(double seconds) { return static_cast<int>(std::lround(seconds * 1000)); }

// A context each: its I/O thread is the socket's own, and closing waits for nobody else.
struct OwnedSocket {
  zmq::context_t context{1};
  zmq::socket_t socket;
};

void configure(zmq::socket_t& socket, const SocketOptions& options) {
  socket.set(zmq::sockopt::linger, milliseconds(options.linger_s));
  socket.set(zmq::sockopt::sndhwm, options.queue_limit);
  socket.set(zmq::sockopt::rcvhwm, options.queue_limit);
  socket.set(zmq::sockopt::maxmsgsize, static_cast<int64_t>(kMaxMessageBytes));
  socket.set(zmq::sockopt::heartbeat_ivl, milliseconds(options.link_heartbeat_s));
  socket.set(zmq::sockopt::heartbeat_timeout, milliseconds(options.link_timeout_s));
  socket.set(zmq::sockopt::heartbeat_ttl, milliseconds(std::min(options.link_timeout_s, 65.0)));
  socket.set(zmq::sockopt::handshake_ivl, milliseconds(options.handshake_s));
  socket.set(zmq::sockopt::reconnect_ivl, milliseconds(options.reconnect_min_s));
  socket.set(zmq::sockopt::reconnect_ivl_max, milliseconds(options.reconnect_max_s));
  socket.set(zmq::sockopt::backlog, 1024);
  socket.set(zmq::sockopt::ipv6, false);
}

Status check_endpoint(const std::string& endpoint) {
  if (endpoint.rfind("tcp://", 0) == 0) {
    if (endpoint.find(':', 6) != std::string::npos) return {};
    return Error{"endpoint '" + endpoint + "' has no port; write tcp://HOST:PORT"};
  }
  if (endpoint.rfind("ipc://", 0) == 0) {
    const std::size_t limit = sizeof(sockaddr_un{}.sun_path) - 1;
    const std::size_t size = endpoint.size() - 6;
    if (size > 0 && size <= limit) return {};
    return Error{"endpoint '" + endpoint + "' has a path of " + std::to_string(size) +
                 " bytes; a socket's may have 1 to " + std::to_string(limit)};
  }
  return Error{"endpoint '" + endpoint + "' is neither tcp://HOST:PORT nor ipc://PATH"};
}

// The rest of a message whose first parts were read.  True when there were none.
bool discard_parts(zmq::socket_t& socket, const zmq::message_t& last) {
  bool more = last.more();
  const bool single = !more;
  while (more) {
    zmq::message_t part;
    if (!socket.recv(part, zmq::recv_flags::dontwait)) break;
    more = part.more();
  }
  return single;
}

void poll_socket(zmq::socket_t& socket, std::span<const int> fds, double timeout_s) {
  std::vector<zmq::pollitem_t> items;
  items.reserve(1 + fds.size());
  items.push_back({socket.handle(), 0, ZMQ_POLLIN, 0});
  for (int fd : fds) items.push_back({nullptr, fd, ZMQ_POLLIN, 0});
  // Rounded up: a caller that waits for a deadline must not find itself just before it.
  const long timeout_ms =
      timeout_s < 0 ? -1 : static_cast<long>(std::ceil(std::min(timeout_s, 3600.0) * 1000));
  zmq_poll(items.data(), static_cast<int>(items.size()), timeout_ms);  // EINTR: the caller looks
}

}  // namespace

struct RouterSocket::Impl : OwnedSocket {};
struct DealerSocket::Impl : OwnedSocket {};

RouterSocket::RouterSocket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RouterSocket::~RouterSocket() = default;

Result<std::unique_ptr<RouterSocket>> RouterSocket::create(const SocketOptions& options) {
  try {
    auto impl = std::make_unique<Impl>();
    impl->socket = zmq::socket_t(impl->context, zmq::socket_type::router);
    configure(impl->socket, options);
    impl->socket.set(zmq::sockopt::router_mandatory, true);
    return std::unique_ptr<RouterSocket>(new RouterSocket(std::move(impl)));
  } catch (const zmq::error_t& error) {
    return Error{std::string("cannot make a socket: ") + error.what()};
  }
}

Result<std::string> RouterSocket::bind(const std::string& endpoint) {
  if (Status status = check_endpoint(endpoint); !status) return status.error();
  try {
    impl_->socket.bind(endpoint);
    return impl_->socket.get(zmq::sockopt::last_endpoint);
  } catch (const zmq::error_t& error) {
    const std::string remedy = error.num() == EADDRINUSE
                                   ? "; another master listens there: stop it or take another port"
                               : error.num() == ENODEV || error.num() == EADDRNOTAVAIL
                                   ? "; name an address or interface of this machine, or *"
                                   : "";
    return Error{"cannot listen on '" + endpoint + "': " + error.what() + remedy};
  }
}

SendStatus RouterSocket::send(const std::string& peer, const std::string& bytes) {
  // The C calls: an unreachable peer is no exception, it happens for every worker that goes.
  void* socket = impl_->socket.handle();
  if (zmq_send(socket, peer.data(), peer.size(), ZMQ_SNDMORE | ZMQ_DONTWAIT) < 0) {
    return zmq_errno() == EHOSTUNREACH ? SendStatus::kUnreachable : SendStatus::kBusy;
  }
  if (zmq_send(socket, bytes.data(), bytes.size(), ZMQ_DONTWAIT) < 0) return SendStatus::kBusy;
  return SendStatus::kSent;
}

bool RouterSocket::receive(Message* message) {
  zmq::message_t peer;
  zmq::message_t bytes;
  try {
    for (;;) {
      if (!impl_->socket.recv(peer, zmq::recv_flags::dontwait)) return false;
      if (!peer.more() || !impl_->socket.recv(bytes, zmq::recv_flags::dontwait)) continue;
      if (!discard_parts(impl_->socket, bytes)) continue;
      message->peer.assign(static_cast<const char*>(peer.data()), peer.size());
      message->bytes.assign(static_cast<const char*>(bytes.data()), bytes.size());
      return true;
    }
  } catch (const zmq::error_t&) {
    return false;  // EINTR: the caller comes back
  }
}

void RouterSocket::wait(std::span<const int> fds, double timeout_s) {
  poll_socket(impl_->socket, fds, timeout_s);
}

DealerSocket::DealerSocket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DealerSocket::~DealerSocket() = default;

Result<std::unique_ptr<DealerSocket>> DealerSocket::connect(const std::string& endpoint,
                                                            const SocketOptions& options) {
  if (Status status = check_endpoint(endpoint); !status) return status.error();
  try {
    auto impl = std::make_unique<Impl>();
    impl->socket = zmq::socket_t(impl->context, zmq::socket_type::dealer);
    configure(impl->socket, options);
    impl->socket.set(zmq::sockopt::immediate, true);
    impl->socket.connect(endpoint);
    return std::unique_ptr<DealerSocket>(new DealerSocket(std::move(impl)));
  } catch (const zmq::error_t& error) {
    return Error{"cannot connect to '" + endpoint + "': " + error.what()};
  }
}

SendStatus DealerSocket::send(const std::string& /*peer*/, const std::string& bytes) {
  const int sent = zmq_send(impl_->socket.handle(), bytes.data(), bytes.size(), ZMQ_DONTWAIT);
  return sent < 0 ? SendStatus::kBusy : SendStatus::kSent;
}

bool DealerSocket::receive(Message* message) {
  zmq::message_t bytes;
  try {
    for (;;) {
      if (!impl_->socket.recv(bytes, zmq::recv_flags::dontwait)) return false;
      if (!discard_parts(impl_->socket, bytes)) continue;
      message->peer.clear();
      message->bytes.assign(static_cast<const char*>(bytes.data()), bytes.size());
      return true;
    }
  } catch (const zmq::error_t&) {
    return false;
  }
}

void DealerSocket::wait(std::span<const int> fds, double timeout_s) {
  poll_socket(impl_->socket, fds, timeout_s);
}

}  // namespace gapfarm
