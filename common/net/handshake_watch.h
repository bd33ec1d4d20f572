// What becomes of a connecting socket's handshakes.  Internal to common/net.
#pragma once

#include <string>
#include <zmq.hpp>

namespace gapfarm {

// Belongs to the socket's thread.
class HandshakeWatch {
 public:
  // Watches `socket`, which connects to `endpoint` afterwards and outlives this.
  HandshakeWatch(zmq::context_t& context, zmq::socket_t& socket, std::string endpoint,
                 double retry_s);
  ~HandshakeWatch();
  HandshakeWatch(const HandshakeWatch&) = delete;
  HandshakeWatch& operator=(const HandshakeWatch&) = delete;

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

}  // namespace gapfarm
