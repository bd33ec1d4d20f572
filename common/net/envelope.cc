#include "common/net/envelope.h"

namespace gapfarm {

std::string encode(v1::Envelope* envelope) {
  envelope->set_protocol(kProtocol);
  return envelope->SerializeAsString();
}

DecodeStatus decode(std::string_view bytes, v1::Envelope* envelope) {
  if (bytes.size() > kMaxMessageBytes) return DecodeStatus::kMalformed;
  if (!envelope->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return DecodeStatus::kMalformed;
  }
  if (envelope->protocol() == 0) return DecodeStatus::kMalformed;
  if (envelope->protocol() != kProtocol) return DecodeStatus::kOtherProtocol;
  if (envelope->body_case() == v1::Envelope::BODY_NOT_SET) return DecodeStatus::kMalformed;
  return DecodeStatus::kOk;
}

}  // namespace gapfarm
