#include "common/net/link_guard.h"

#include <linux/tcp.h>
#include <netinet/in.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <mutex>
#include <random>
#include <utility>

#include "common/base/clock.h"

namespace gapfarm {
namespace {

constexpr const char* kMonitorEndpoint = "inproc://links";
constexpr const char* kZapEndpoint = "inproc://zeromq.zap.01";
constexpr int kEvents = ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_DISCONNECTED |
                        ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                        ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
constexpr double kListInterval = 1;            // s between two looks at the allow-list
constexpr long kStrangersInterval_ms = 10;     // between two looks at what strangers have sent
constexpr double kComplaintsInterval = 60;     // s, after which a peer may be named again
constexpr std::size_t kComplaints = 10;        // in that time
constexpr std::size_t kDescriptors = 1 << 16;  // larger ones are not accepted

// Distinguishes two connections with one descriptor; 0: no socket.
std::uint64_t cookie_of(int fd) {
  std::uint64_t cookie = 0;
  socklen_t size = sizeof cookie;
  return getsockopt(fd, SOL_SOCKET, SO_COOKIE, &cookie, &size) == 0 ? cookie : 0;
}

std::uint64_t received_bytes(int fd) {
  tcp_info info = {};
  socklen_t size = sizeof info;
  if (getsockopt(fd, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return 0;
  return info.tcpi_bytes_received;
}

std::string text_of(const zmq::message_t& part) {
  return {static_cast<const char*>(part.data()), part.size()};
}

bool receive_parts(zmq::socket_t& socket, std::vector<zmq::message_t>* parts) {
  parts->clear();
  do {
    zmq::message_t part;
    if (!socket.recv(part, zmq::recv_flags::dontwait)) return false;
    parts->push_back(std::move(part));
  } while (parts->back().more());
  return true;
}

}  // namespace

const std::string* AllowList::find(const std::string& key, double now) {
  if (now - read_ > kListInterval) {
    read_ = now;
    names_.clear();
    if (auto keys = read_listed_keys(folder_, nullptr)) {
      for (PublicKey& listed : *keys) names_[listed.key] = std::move(listed.name);
    }
  }
  const auto found = names_.find(key);
  return found == names_.end() ? nullptr : &found->second;
}

// What the socket's thread and the guard's have in common.
struct LinkGuard::Shared {
  Shared() : wake(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)), strange(kDescriptors) {}
  ~Shared() { close(wake); }

  int wake;
  std::atomic<std::size_t> strangers{0};
  std::vector<std::atomic<bool>> strange;  // by descriptor
  mutable std::mutex mutex;
  LinkCounts counts;
  std::vector<std::string> complaints;
  std::set<std::string> named;
  double named_since = -1e9;

  void complain(const std::string& about, const std::string& text) {
    const std::lock_guard lock(mutex);
    if (monotonic_seconds() - named_since > kComplaintsInterval) {
      named.clear();
      named_since = monotonic_seconds();
    }
    if (named.size() < kComplaints && named.insert(about).second) complaints.push_back(text);
  }
};

// The guard's thread.
class LinkGuard::Watch {
 public:
  Watch(Shared& shared, zmq::socket_t monitor, zmq::socket_t zap, const LinkSecurity& security,
        const LinkLimits& limits)
      : shared_(shared),
        monitor_(std::move(monitor)),
        zap_(std::move(zap)),
        listed_(security.listed),
        limits_(limits),
        random_(std::random_device{}()) {}

  void run() {
    std::vector<zmq::pollitem_t> items = {{nullptr, shared_.wake, ZMQ_POLLIN, 0},
                                          {monitor_.handle(), 0, ZMQ_POLLIN, 0},
                                          {zap_.handle(), 0, ZMQ_POLLIN, 0}};
    for (;;) {
      zmq_poll(items.data(), static_cast<int>(items.size()),
               strangers_.empty() ? -1 : kStrangersInterval_ms);
      if ((items[0].revents & ZMQ_POLLIN) != 0) return;
      try {
        answer_zap();
        read_events();
      } catch (const zmq::error_t&) {  // EINTR: again
      }
      mind_strangers();
    }
  }

 private:
  struct Link {
    std::uint64_t cookie;
    bool closing = false;
  };

  void answer_zap() {
    std::vector<zmq::message_t> request;
    while (receive_parts(zap_, &request)) {
      std::string user;
      const bool allowed = request.size() >= 6 && judge(request, &user);
      const std::array<std::string, 6> reply = {"1.0",
                                                request.size() > 1 ? text_of(request[1]) : "",
                                                allowed ? "200" : "400",
                                                allowed ? "OK" : "not listed",
                                                user,
                                                ""};
      for (std::size_t i = 0; i < reply.size(); ++i) {
        zap_.send(zmq::buffer(reply[i]),
                  i + 1 < reply.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
      }
    }
  }

  // version, request, domain, address, routing id, mechanism, and credentials of CURVE
  bool judge(const std::vector<zmq::message_t>& request, std::string* user) {
    const std::string domain = text_of(request[2]), mechanism = text_of(request[5]);
    if (domain == kOpenDomain) return mechanism == "NULL";
    if (text_of(request[0]) != "1.0" || domain != kZapDomain || mechanism != "CURVE" ||
        request.size() != 7 || request[6].size() != 32) {
      return false;
    }
    std::array<char, 41> key = {};
    zmq_z85_encode(key.data(), static_cast<const std::uint8_t*>(request[6].data()), 32);
    if (const std::string* name = listed_.find(key.data(), monotonic_seconds()); name != nullptr) {
      *user = *name;
      return true;
    }
    count([](LinkCounts& counts) { ++counts.refused_keys; });
    shared_.complain(key.data(), "a worker at " + text_of(request[3]) + " has the key " +
                                     key.data() + ", which is not listed; if it is yours: " +
                                     "gapfarm keys allow NAME --key '" + key.data() + "'");
    return false;
  }

  void read_events() {
    std::vector<zmq::message_t> parts;
    while (receive_parts(monitor_, &parts)) {
      if (parts.size() != 2 || parts[0].size() < 6) continue;
      std::uint16_t event = 0;
      std::int32_t value = 0;
      std::memcpy(&event, parts[0].data(), sizeof event);
      std::memcpy(&value, static_cast<const char*>(parts[0].data()) + sizeof event, sizeof value);
      if (text_of(parts[1]).rfind("tcp://", 0) == 0) on_event(event, value);
    }
  }

  void on_event(std::uint16_t event, std::int32_t value) {
    if (event == ZMQ_EVENT_ACCEPTED) {
      on_accepted(value);
    } else if (event == ZMQ_EVENT_DISCONNECTED) {
      links_.erase(value);
      forget_stranger(value);
      count([&](LinkCounts& counts) { counts.open = links_.size(); });
    } else {
      count([](LinkCounts& counts) { ++counts.failed_handshakes; });
    }
  }

  void on_accepted(int fd) {
    Link& link = links_[fd] = {cookie_of(fd)};
    forget_stranger(fd);
    count([&](LinkCounts& counts) {
      ++counts.accepted;
      counts.open = links_.size();
    });
    if (links_.size() > limits_.connections || static_cast<std::size_t>(fd) >= kDescriptors) {
      shared_.complain("connections", "more than " + std::to_string(limits_.connections) +
                                          " connections; the next are closed");
      drop(fd, link);
      return;
    }
    shared_.strange[fd] = true;
    strangers_.push_back(fd);
    // Whichever falls, an honest peer comes again, and none of them can be distinguished from the
    // others.
    while (strangers_.size() > limits_.strangers) drop_stranger(random_() % strangers_.size());
  }

  void mind_strangers() {
    std::erase_if(strangers_, [&](int fd) { return !shared_.strange[fd]; });
    const double now = monotonic_seconds();
    if (!strangers_.empty() && now >= next_weighing_) {
      next_weighing_ = now + 1e-3 * kStrangersInterval_ms;
      weigh_strangers();
    }
    shared_.strangers = strangers_.size();
  }

  // Drops those that have sent most while all together have sent too much.
  void weigh_strangers() {
    std::vector<std::pair<std::uint64_t, int>> weights;
    std::uint64_t sum = 0;
    for (int fd : strangers_) {
      weights.emplace_back(received_bytes(fd), fd);
      sum += weights.back().first;
    }
    if (sum <= limits_.stranger_bytes) return;
    std::sort(weights.rbegin(), weights.rend());
    for (const auto& [bytes, fd] : weights) {
      if (sum <= limits_.stranger_bytes) break;
      sum -= bytes;
      drop_stranger(static_cast<std::size_t>(std::find(strangers_.begin(), strangers_.end(), fd) -
                                             strangers_.begin()));
    }
  }

  void drop_stranger(std::size_t index) {
    const int fd = strangers_[index];
    forget_stranger(fd);
    if (const auto link = links_.find(fd); link != links_.end()) drop(fd, link->second);
  }

  void forget_stranger(int fd) {
    if (static_cast<std::size_t>(fd) < kDescriptors) {
      shared_.strange[fd] = false;
    }
    std::erase(strangers_, fd);
  }

  // The socket's own thread closes it when it reads the end.  Should the descriptor have been used
  // again in between, the cookie decides.
  void drop(int fd, Link& link) {
    if (link.closing || link.cookie == 0 || cookie_of(fd) != link.cookie) return;
    link.closing = true;
    ::shutdown(fd, SHUT_RDWR);
    count([](LinkCounts& counts) { ++counts.dropped; });
  }

  template <class Change>
  void count(Change change) {
    const std::lock_guard lock(shared_.mutex);
    change(shared_.counts);
  }

  Shared& shared_;
  zmq::socket_t monitor_;
  zmq::socket_t zap_;
  AllowList listed_;
  LinkLimits limits_;
  std::minstd_rand random_;
  std::unordered_map<int, Link> links_;  // by descriptor
  std::vector<int> strangers_;
  double next_weighing_ = 0;
};

LinkGuard::LinkGuard(zmq::context_t& context, zmq::socket_t& router, const LinkSecurity& security,
                     const LinkLimits& limits)
    : shared_(std::make_unique<Shared>()), router_(router) {
  zmq::socket_t zap(context, zmq::socket_type::rep);
  zap.set(zmq::sockopt::linger, 0);
  zap.bind(kZapEndpoint);
  if (zmq_socket_monitor(router.handle(), kMonitorEndpoint, kEvents) != 0) throw zmq::error_t();
  zmq::socket_t monitor(context, zmq::socket_type::pair);
  monitor.set(zmq::sockopt::linger, 0);
  monitor.set(zmq::sockopt::rcvhwm, 0);  // the I/O thread must never wait for this one
  monitor.connect(kMonitorEndpoint);
  thread_ =
      std::thread([watch = std::make_shared<Watch>(*shared_, std::move(monitor), std::move(zap),
                                                   security, limits)] { watch->run(); });
}

LinkGuard::~LinkGuard() {
  zmq_socket_monitor(router_.handle(), nullptr, 0);
  const std::uint64_t one = 1;
  if (write(shared_->wake, &one, sizeof one) < 0) std::terminate();
  thread_.join();
}

void LinkGuard::heard(const zmq::message_t& message) {
  if (shared_->strangers.load(std::memory_order_relaxed) == 0) return;
  const int fd = zmq_msg_get(const_cast<zmq_msg_t*>(message.handle()), ZMQ_SRCFD);
  if (fd < 0 || static_cast<std::size_t>(fd) >= kDescriptors) return;
  shared_->strange[fd].store(false, std::memory_order_relaxed);
}

LinkCounts LinkGuard::counts() const {
  const std::lock_guard lock(shared_->mutex);
  LinkCounts counts = shared_->counts;
  counts.strangers = shared_->strangers;
  return counts;
}

std::vector<std::string> LinkGuard::take_complaints() {
  const std::lock_guard lock(shared_->mutex);
  return std::exchange(shared_->complaints, {});
}

}  // namespace gapfarm
