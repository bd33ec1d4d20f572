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
std::string encode(v1::Envelope* envelope);

// Reads into `envelope`, whose memory is used again.  Never trusts a byte.
DecodeStatus decode(std::string_view bytes, v1::Envelope* envelope);

}  // namespace gapfarm
