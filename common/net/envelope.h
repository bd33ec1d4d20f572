// Envelopes to bytes and back.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "gapfarm/v1/farm.pb.h"

namespace gapfarm {

// Raised whenever an older peer would misread a message.
inline constexpr std::uint32_t kProtocol = 2;

// No envelope is longer; sockets drop the connection of a peer that sends more.
inline constexpr std::size_t kMaxMessageBytes = std::size_t{64} << 20;

enum class DecodeStatus {
  kOk,
  kMalformed,      // not an envelope, without a body, or longer than kMaxMessageBytes
  kOtherProtocol,  // an envelope of another protocol version, left in envelope->protocol()
};

// Sets the protocol version.
inline std::string encode(v1::Envelope* envelope) {
  envelope->set_protocol(kProtocol);
  return envelope->SerializeAsString();
}

// Reads into `envelope`, whose memory is used again.  Never trusts a byte.
inline DecodeStatus decode(std::string_view bytes, v1::Envelope* envelope) {
  if (bytes.size() > kMaxMessageBytes) return DecodeStatus::kMalformed;
  if (!envelope->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return DecodeStatus::kMalformed;
  }
  if (envelope->protocol() == 0) return DecodeStatus::kMalformed;
  if (envelope->protocol() != kProtocol) return DecodeStatus::kOtherProtocol;
  if (envelope->body_case() == v1::Envelope::BODY_NOT_SET) return DecodeStatus::kMalformed;
  return DecodeStatus::kOk;
}

// Messages between peers, without a word about sockets: the master's and the workers' state
// machines run over ZeroMQ (socket.h) or, under test, over a simulated network.

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
