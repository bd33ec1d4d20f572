// gapfarm-fault-proxy: between a master and its workers, it drops, doubles, delays and reorders
// messages.  Which ones follows from the seed and the order in which messages arrive.
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <queue>
#include <random>
#include <string>
#include <utility>
#include <vector>
#include <zmq.hpp>

#include "common/base/clock.h"
#include "common/process/stop.h"

namespace gapfarm {
namespace {

constexpr double kForgetPeer = 10;     // s of silence after which a worker's link is closed
constexpr double kLongestDelay = 0.2;  // s
constexpr double kLongestReorder = 0.1;

struct Options {
  std::string listen;   // for the workers
  std::string connect;  // to the master
  std::uint64_t seed;
  double share;  // of the messages are disturbed
};

struct Counts {
  unsigned long passed = 0, dropped = 0, doubled = 0, delayed = 0, reordered = 0;
};

// A worker's link to the master: the master sees every worker as a peer of its own.
struct Link {
  std::string peer;
  zmq::socket_t to_master;
  double last_heard = 0;
  // Held back until the next message of the same direction has passed: to the master, to the
  // worker.
  std::optional<std::string> held[2];
};

class Proxy {
 public:
  explicit Proxy(const Options& options)
      : options_(options), random_(options.seed), front_(context_, zmq::socket_type::router) {
    front_.set(zmq::sockopt::router_mandatory, true);
    front_.set(zmq::sockopt::linger, 0);
    front_.bind(options.listen);
  }

  void run(StopSource& stop) {
    while (!stop.requested()) {
      wait(stop);
      now_ = monotonic_seconds();
      from_workers();
      from_master();
      for (; !later_.empty() && later_.top().when <= now_; later_.pop()) later_.top().deliver();
      std::erase_if(links_, [this](const auto& entry) {
        return now_ - entry.second->last_heard > kForgetPeer;
      });
    }
  }

  const Counts& counts() const { return counts_; }

 private:
  struct Later {
    double when;
    unsigned long order;
    std::function<void()> deliver;
    bool operator<(const Later& other) const {
      return when != other.when ? when > other.when : order > other.order;
    }
  };

  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

  void wait(const StopSource& stop) {
    std::vector<zmq::pollitem_t> items = {{front_.handle(), 0, ZMQ_POLLIN, 0},
                                          {nullptr, stop.fd(), ZMQ_POLLIN, 0}};
    for (const auto& [peer, link] : links_) {
      items.push_back({link->to_master.handle(), 0, ZMQ_POLLIN, 0});
    }
    double wait_s = 1;
    if (!later_.empty()) wait_s = std::clamp(later_.top().when - monotonic_seconds(), 0.0, 1.0);
    zmq_poll(items.data(), static_cast<int>(items.size()), static_cast<long>(wait_s * 1000) + 1);
  }

  void from_workers() {
    zmq::message_t peer, bytes;
    while (front_.recv(peer, zmq::recv_flags::dontwait)) {
      if (!peer.more() || !front_.recv(bytes, zmq::recv_flags::dontwait)) continue;
      std::shared_ptr<Link>& link = links_[peer.to_string()];
      if (!link) link = connected(peer.to_string());
      link->last_heard = now_;
      disturb(link, 0, bytes.to_string());
    }
  }

  void from_master() {
    std::vector<std::shared_ptr<Link>> links;
    for (const auto& [peer, link] : links_) links.push_back(link);
    zmq::message_t bytes;
    for (const auto& link : links) {
      while (link->to_master.recv(bytes, zmq::recv_flags::dontwait)) {
        disturb(link, 1, bytes.to_string());
      }
    }
  }

  std::shared_ptr<Link> connected(const std::string& peer) {
    auto link = std::make_shared<Link>();
    link->peer = peer;
    link->to_master = zmq::socket_t(context_, zmq::socket_type::dealer);
    link->to_master.set(zmq::sockopt::linger, 0);
    link->to_master.set(zmq::sockopt::immediate, true);
    link->to_master.set(zmq::sockopt::reconnect_ivl, 20);
    link->to_master.set(zmq::sockopt::reconnect_ivl_max, 100);
    link->to_master.connect(options_.connect);
    return link;
  }

  void disturb(const std::shared_ptr<Link>& link, int direction, std::string bytes) {
    std::optional<std::string> held = std::exchange(link->held[direction], std::nullopt);
    const double drawn = uniform() / options_.share;
    if (drawn >= 1) {
      ++counts_.passed;
      send(*link, direction, bytes);
    } else if (drawn < 0.25) {
      ++counts_.dropped;
    } else if (drawn < 0.5) {
      ++counts_.doubled;
      send(*link, direction, bytes);
      send(*link, direction, bytes);
    } else if (drawn < 0.75) {
      ++counts_.delayed;
      at(uniform() * kLongestDelay,
         [this, link, direction, bytes] { send(*link, direction, bytes); });
    } else {
      ++counts_.reordered;
      link->held[direction] = bytes;
      at(kLongestReorder, [this, link, direction] { release(*link, direction); });
    }
    if (held) send(*link, direction, *held);
  }

  void release(Link& link, int direction) {
    if (auto held = std::exchange(link.held[direction], std::nullopt)) send(link, direction, *held);
  }

  void at(double in_s, std::function<void()> deliver) {
    later_.push({now_ + in_s, ++order_, std::move(deliver)});
  }

  // Whoever is not there does not get it.
  void send(Link& link, int direction, const std::string& bytes) {
    if (direction == 0) {
      zmq_send(link.to_master.handle(), bytes.data(), bytes.size(), ZMQ_DONTWAIT);
      return;
    }
    const std::string& peer = link.peer;
    if (zmq_send(front_.handle(), peer.data(), peer.size(), ZMQ_SNDMORE | ZMQ_DONTWAIT) < 0) {
      link.last_heard = -kForgetPeer;
      return;
    }
    zmq_send(front_.handle(), bytes.data(), bytes.size(), ZMQ_DONTWAIT);
  }

  Options options_;
  std::mt19937_64 random_;
  zmq::context_t context_;
  zmq::socket_t front_;
  std::map<std::string, std::shared_ptr<Link>> links_;
  std::priority_queue<Later> later_;
  unsigned long order_ = 0;
  double now_ = 0;
  Counts counts_;
};

}  // namespace
}  // namespace gapfarm

int main(int argc, char** argv) {
  std::map<std::string, std::string> given = {{"--seed", "1"}, {"--share", "0.1"}};
  for (int i = 1; i + 1 < argc; i += 2) given[argv[i]] = argv[i + 1];
  gapfarm::Options options{given["--listen"], given["--connect"],
                           std::strtoull(given["--seed"].c_str(), nullptr, 10),
                           std::strtod(given["--share"].c_str(), nullptr)};
  if (given.size() != 4 || options.listen.empty() || options.connect.empty()) {
    std::fprintf(stderr,
                 "usage: gapfarm-fault-proxy --listen WORKERS --connect MASTER [--seed N] "
                 "[--share OF_THE_MESSAGES]\n");
    return 2;
  }
  gapfarm::StopSource stop;
  const gapfarm::StopOnSignals signals(&stop);
  gapfarm::Proxy proxy(options);
  proxy.run(stop);
  const gapfarm::Counts& c = proxy.counts();
  std::printf("passed %lu dropped %lu doubled %lu delayed %lu reordered %lu\n", c.passed, c.dropped,
              c.doubled, c.delayed, c.reordered);
  return 0;
}
