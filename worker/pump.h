// Moves messages between a transport and the worker's session.
#pragma once

#include "common/net/envelope.h"
#include "worker/session.h"

namespace gapfarm {

// Handles what has arrived.  True: something had.
bool pump_in(Transport& transport, WorkerSession& session, double now);
// Sends what is to be sent.
void pump_out(Transport& transport, WorkerSession& session);

}  // namespace gapfarm
