#include "worker/pump.h"

namespace gapfarm {

bool pump_in(Transport& transport, WorkerSession& session, double now) {
  Message message;
  v1::Envelope envelope;
  bool any = false;
  while (transport.receive(&message)) {
    any = true;
    const DecodeStatus status = decode(message.bytes, &envelope);
    if (status == DecodeStatus::kOk) session.on_message(&envelope, now);
    if (status == DecodeStatus::kOtherProtocol) session.on_other_protocol(envelope.protocol());
  }
  return any;
}

void pump_out(Transport& transport, WorkerSession& session) {
  for (v1::Envelope& envelope : session.take_outbox()) {
    if (transport.send("", encode(&envelope)) != SendStatus::kSent) session.on_unsent(&envelope);
  }
}

}  // namespace gapfarm
