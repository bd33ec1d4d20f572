// Messages between peers, without a word about sockets: the master's and the workers' state
// machines run over ZeroMQ (socket.h) or, under test, over a simulated network.
#pragma once

#include <string>

namespace gapfarm {

struct Message {
  std::string peer;   // who sent it, as send() takes it; empty when there is only one peer
  std::string bytes;  // one envelope (envelope.h)
};

enum class SendStatus {
  kSent,         // handed over; it may still be lost on the way
  kUnreachable,  // nobody of that name is connected
  kBusy,         // the peer takes no more for now, or no connection stands yet
};

// Never blocks.  Belongs to one thread.
class Transport {
 public:
  virtual ~Transport() = default;
  virtual SendStatus send(const std::string& peer, const std::string& bytes) = 0;
  // False: nothing has arrived.
  virtual bool receive(Message* message) = 0;
};

}  // namespace gapfarm
