#include "common/net/handshake_watch.h"

#include <chrono>
#include <cstring>
#include <utility>

namespace gapfarm {
namespace {

constexpr const char* kHandshakes = "inproc://handshakes";
constexpr int kHandshakeEvents =
    ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
    ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

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
  if (retry_at_ < 0 || now_s() < retry_at_) return;
  retry_at_ = -1;
  zmq_disconnect(socket_.handle(), endpoint_.c_str());  // may have gone already
  socket_.connect(endpoint_);
}

void HandshakeWatch::on_event(unsigned event, int value) {
  if (event == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) {
    last_failure_ = 0;
    return;
  }
  if (event == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL) retry_at_ = now_s() + retry_s_;
  if (event == last_failure_) return;
  last_failure_ = event;
  const std::string master = "the master at " + endpoint_;
  if (event == ZMQ_EVENT_HANDSHAKE_FAILED_AUTH) {
    trouble_ = master + " does not list this worker's key (status " + std::to_string(value) +
               "); there: gapfarm keys allow NAME FILE, with the worker.pub from here";
  } else if (event == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL &&
             value == ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH) {
    trouble_ = master +
               " wants another security than this worker: one of them runs with "
               "--insecure and the other with keys";
  } else if (event == ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL) {
    trouble_ = "what answers at " + endpoint_ + " is no gapfarm master";
  } else {
    trouble_ = master +
               " ended the link before it stood; if this goes on, master.pub here is not "
               "the key that it has";
  }
}

std::string HandshakeWatch::take_trouble() { return std::exchange(trouble_, {}); }

}  // namespace gapfarm
