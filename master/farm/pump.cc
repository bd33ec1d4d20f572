#include "master/farm/pump.h"

namespace gapfarm {
namespace {

// Messages before the answers to them go out: sending pays off in bulk, waiting does not.
constexpr int kReceiveAtOnce = 256;

int receive_some(Transport& transport, Scheduler& scheduler, double now) {
  Message message;
  v1::Envelope envelope;
  int received = 0;
  while (received < kReceiveAtOnce && transport.receive(&message)) {
    ++received;
    switch (decode(message.bytes, &envelope)) {
      case DecodeStatus::kOk:
        scheduler.on_message(message.peer, &envelope, now);
        break;
      case DecodeStatus::kOtherProtocol:
        scheduler.on_other_protocol(message.peer, envelope.protocol());
        break;
      case DecodeStatus::kMalformed:
        scheduler.on_malformed(message.peer);
        break;
    }
  }
  return received;
}

// False: somebody was not there, and what it should have got waits again.
bool send_all(Transport& transport, Scheduler& scheduler) {
  std::vector<Outgoing> outgoing;
  outgoing.swap(scheduler.outbox());
  std::vector<Outgoing> unsent;
  for (Outgoing& out : outgoing) {
    if (transport.send(out.peer, encode(&out.envelope)) != SendStatus::kSent) {
      unsent.push_back(std::move(out));
    }
  }
  scheduler.on_unsent(unsent);
  return unsent.empty();
}

}  // namespace

bool pump(Transport& transport, Scheduler& scheduler, double now) {
  const int received = receive_some(transport, scheduler, now);
  if (received == kReceiveAtOnce) {
    // Too early to judge anybody's silence; but jobs go out, or the workers would idle.
    scheduler.dispatch(now);
  } else {
    scheduler.on_tick(now);
  }
  const bool sent = send_all(transport, scheduler);
  return received > 0 || !sent;
}

}  // namespace gapfarm
