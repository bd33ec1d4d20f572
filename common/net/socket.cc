#include "common/net/socket.h"

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <zmq.hpp>

#include "common/base/clock.h"
#include "common/net/link_guard.h"

namespace gapfarm {

// Belongs to the socket's thread.
class HandshakeWatch {
 public:
  // Watches `socket`, which connects to `endpoint` afterwards and outlives this.
  HandshakeWatch(zmq::context_t& context, zmq::socket_t& socket, std::string endpoint,
                 double retry_s);
  ~HandshakeWatch();
  HandshakeWatch& operator=(HandshakeWatch&&) = delete;

  // Handles what has happened.  After an answer that is no proper ZMTP, or another mechanism,
  // ZeroMQ gives an endpoint up for good; here it is connected to again, `retry_s` later.
  void look();
  // A sentence for each new kind of failure; empty: none.
  std::string take_trouble();

 private:
  void on_event(unsigned event, int value);

  zmq::socket_t& socket_;
  zmq::socket_t monitor_;
  std::string endpoint_;
  double retry_s_;
  double retry_at_ = -1;  // s, monotonic; negative: no need
  unsigned last_failure_ = 0;
  std::string trouble_;
};

namespace {

constexpr const char* kHandshakes = "inproc://handshakes";
constexpr int kHandshakeEvents =
    ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
    ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;

}  // namespace

HandshakeWatch::HandshakeWatch(zmq::context_t& context, zmq::socket_t& socket, std::string endpoint,
                               double retry_s)
    : socket_(socket),
      monitor_(context, zmq::socket_type::pair),
      endpoint_(std::move(endpoint)),
      retry_s_(retry_s) {
  if (zmq_socket_monitor(socket.handle(), kHandshakes, kHandshakeEvents) != 0) throw zmq::error_t();
  monitor_.set(zmq::sockopt::linger, 0);
  monitor_.set(zmq::sockopt::rcvhwm, 0);  // the I/O thread must never wait for this one
  monitor_.connect(kHandshakes);
}

HandshakeWatch::~HandshakeWatch() { zmq_socket_monitor(socket_.handle(), nullptr, 0); }

void HandshakeWatch::look() {
  zmq::message_t event, address;
  while (monitor_.recv(event, zmq::recv_flags::dontwait)) {
    if (event.more()) (void)monitor_.recv(address);
    if (event.size() < 6) continue;
    std::uint16_t kind = 0;
    std::int32_t value = 0;
    std::memcpy(&kind, event.data(), sizeof kind);
    std::memcpy(&value, static_cast<const char*>(event.data()) + sizeof kind, sizeof value);
    on_event(kind, value);
  }
  if (retry_at_ < 0 || monotonic_seconds() < retry_at_) return;
  retry_at_ = -1;
  zmq_disconnect(socket_.handle(), endpoint_.c_str());  // may have gone already
  socket_.connect(endpoint_);
}

void HandshakeWatch::on_event(unsigned event, int value) {
  if (event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) {
    last_failure_ = 0;
    return;
  }
  if (event == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL) retry_at_ = monotonic_seconds() + retry_s_;
  if (event == last_failure_) return;
  last_failure_ = event;
  const std::string master = "the master at " + endpoint_;
  if (event == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH) {
    trouble_ = master + " does not list this worker's key (status " + std::to_string(value) +
               "); there: gapfarm keys allow NAME FILE, with the worker.pub from here";
  } else if (event == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL &&
             value == ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH) {
    trouble_ = master +
               " wants another security than this worker: one of them runs with --insecure and the "
               "other with keys";
  } else if (event == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL) {
    trouble_ = "what answers at " + endpoint_ + " is no gapfarm master";
  } else {
    trouble_ = master +
               " ended the link before it stood; if this goes on, master.pub here is not the key "
               "that it has";
  }
}

std::string HandshakeWatch::take_trouble() { return std::exchange(trouble_, {}); }

// A context each: its I/O thread is the socket's own, and closing waits for nobody else.
struct OwnedSocket {
  zmq::context_t context{1};
  zmq::socket_t socket;
};

namespace {

// What is made during its life is nobody's but its maker's.
class PrivateFiles {
 public:
  PrivateFiles() = default;
  PrivateFiles(const PrivateFiles&) = delete;
  PrivateFiles& operator=(const PrivateFiles&) = delete;
  ~PrivateFiles() { umask(before_); }

 private:
  const mode_t before_ = umask(0077);
};

int milliseconds(double seconds) { return static_cast<int>(std::lround(seconds * 1000)); }

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
}

bool is_tcp(const std::string& endpoint) { return endpoint.rfind("tcp://", 0) == 0; }

bool is_ipv6(const std::string& endpoint) { return endpoint.starts_with("tcp://["); }

bool is_loopback(const std::string& endpoint) {
  const std::string host = endpoint.substr(6, endpoint.rfind(':') - 6);
  return host == "localhost" || host == "[::1]" ||
         (host.rfind("127.", 0) == 0 && host.find_first_not_of("0123456789.") == std::string::npos);
}

// Thousands of peers need more descriptors than the usual 1,024.  Returns how many there may be.
std::size_t raise_descriptor_limit() {
  rlimit limit = {};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return 1024;
  if (limit.rlim_cur < limit.rlim_max) {
    const rlim_t before = limit.rlim_cur;
    limit.rlim_cur = limit.rlim_max;
    if (setrlimit(RLIMIT_NOFILE, &limit) != 0) limit.rlim_cur = before;
  }
  return limit.rlim_cur;
}

// Descriptors that are not connections: run store, children, logs.
constexpr std::size_t kReservedDescriptors = 200;

LinkLimits within_descriptors(LinkLimits limits) {
  const std::size_t most = raise_descriptor_limit();
  const std::size_t usable =
      most > 2 * kReservedDescriptors ? most - kReservedDescriptors : most / 2;
  limits.connections = std::min(limits.connections, usable);
  return limits;
}

// Applies to the endpoints bound from now on.  Without a ZAP handler ZeroMQ would let any key in;
// the guard's is bound before the first endpoint, stays as long as the socket is used, and lets in
// nobody of another domain.
void secure_server(zmq::socket_t& socket, const LinkSecurity& security, bool curve) {
  socket.set(zmq::sockopt::curve_server, curve);
  if (curve) {
    socket.set(zmq::sockopt::curve_secretkey, security.own->secret_key);
  }
  // Of its own: libzmq 4.3.4 cannot set a domain back to none.
  socket.set(zmq::sockopt::zap_domain, curve ? kZapDomain : kOpenDomain);
}

void secure_client(zmq::socket_t& socket, const LinkSecurity& security) {
  socket.set(zmq::sockopt::curve_serverkey, security.master_key);
  socket.set(zmq::sockopt::curve_publickey, security.own->public_key);
  socket.set(zmq::sockopt::curve_secretkey, security.own->secret_key);
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

Error needs_keys(const std::string& endpoint) {
  return Error{"'" + endpoint + "' needs keys, and none were given; make them with `gapfarm keys " +
               "make`, or ask for an open link with --insecure"};
}

}  // namespace

Status check_endpoint(const std::string& endpoint) {
  if (endpoint.rfind("tcp://", 0) == 0) {
    const std::size_t colon = endpoint.rfind(':');
    const std::string port = colon > 6 ? endpoint.substr(colon + 1) : "";
    if (port == "*") return {};
    const bool number = !port.empty() && port.find_first_not_of("0123456789") == port.npos;
    if (number && port.size() <= 5 && std::stoul(port) <= 65535) return {};
    return Error{"endpoint '" + endpoint + "' has the port '" + port +
                 "'; write tcp://HOST:PORT with a port from 1 to 65535"};
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

Status may_listen(const std::string& endpoint, const LinkSecurity& security) {
  RETURN_IF_ERROR(check_endpoint(endpoint));
  if (!is_tcp(endpoint) || security.open == OpenLinks::kAnywhere) return {};
  if (security.open == OpenLinks::kLoopback) {
    if (is_loopback(endpoint)) return {};
    return Error{"--insecure keeps to this machine (127.0.0.1), and '" + endpoint +
                 "' is open to others: anybody could send forged results; make keys with `gapfarm "
                 "keys make`, or add --insecure-anywhere on a network that you trust wholly"};
  }
  if (security.own && !security.listed.empty()) return {};
  return needs_keys(endpoint);
}

struct RouterSocket::Impl : OwnedSocket {
  LinkSecurity security;
  std::unique_ptr<LinkGuard> guard;
};
struct DealerSocket::Impl : OwnedSocket {
  std::unique_ptr<HandshakeWatch> watch;
};

RouterSocket::RouterSocket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RouterSocket::~RouterSocket() = default;

Result<std::unique_ptr<RouterSocket>> RouterSocket::create(const SocketOptions& options) {
  try {
    auto impl = std::make_unique<Impl>();
    impl->socket = zmq::socket_t(impl->context, zmq::socket_type::router);
    configure(impl->socket, options);
    impl->socket.set(zmq::sockopt::router_mandatory, true);
    impl->security = options.security;
    impl->guard = std::make_unique<LinkGuard>(impl->context, impl->socket, options.security,
                                              within_descriptors(options.limits));
    return std::unique_ptr<RouterSocket>(new RouterSocket(std::move(impl)));
  } catch (const zmq::error_t& error) {
    return Error{std::string("cannot make a socket: ") + error.what()};
  }
}

Result<std::string> RouterSocket::bind(const std::string& endpoint) {
  const LinkSecurity& security = impl_->security;
  RETURN_IF_ERROR(may_listen(endpoint, security));
  try {
    secure_server(impl_->socket, security, is_tcp(endpoint) && security.open == OpenLinks::kNever);
    const PrivateFiles only_ours;  // nobody else may connect to a socket in the file system
    impl_->socket.set(zmq::sockopt::ipv6, is_ipv6(endpoint));
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
      impl_->guard->heard(bytes);
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

LinkCounts RouterSocket::link_counts() const { return impl_->guard->counts(); }

std::vector<std::string> RouterSocket::take_complaints() { return impl_->guard->take_complaints(); }

DealerSocket::DealerSocket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
DealerSocket::~DealerSocket() = default;

Result<std::unique_ptr<DealerSocket>> DealerSocket::connect(const std::string& endpoint,
                                                            const SocketOptions& options) {
  RETURN_IF_ERROR(check_endpoint(endpoint));
  if (is_tcp(endpoint) && (endpoint.ends_with(":0") || endpoint.ends_with(":*"))) {
    return Error{"endpoint '" + endpoint + "' names no port; give the one that the master printed"};
  }
  const LinkSecurity& security = options.security;
  const bool has_keys = security.own.has_value() && !security.master_key.empty();
  const bool open = security.open != OpenLinks::kNever;
  if (is_tcp(endpoint) && !open && !has_keys) return needs_keys(endpoint);
  try {
    auto impl = std::make_unique<Impl>();
    impl->socket = zmq::socket_t(impl->context, zmq::socket_type::dealer);
    configure(impl->socket, options);
    impl->socket.set(zmq::sockopt::immediate, true);
    impl->socket.set(zmq::sockopt::ipv6, is_ipv6(endpoint));
    if (is_tcp(endpoint) && !open) secure_client(impl->socket, security);
    impl->watch = std::make_unique<HandshakeWatch>(impl->context, impl->socket, endpoint,
                                                   options.reconnect_max_s);
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
    impl_->watch->look();
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

std::string DealerSocket::take_trouble() { return impl_->watch->take_trouble(); }

}  // namespace gapfarm
