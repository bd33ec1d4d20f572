// Moves messages between a transport and the scheduler.
#pragma once

#include "common/net/envelope.h"
#include "master/farm/scheduler.h"

namespace gapfarm {

// Handles what has arrived, lets the scheduler decide and sends what it decided.  True: something
// happened and more may be waiting; do not sleep yet.
bool pump(Transport& transport, Scheduler& scheduler, double now);

}  // namespace gapfarm
