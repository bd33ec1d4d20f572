// A fleet beside its master: reports to it, learns its backlog, and goes when it goes.
#pragma once

#include <functional>
#include <string>

#include "common/net/keys.h"
#include "common/process/stop.h"
#include "master/farm/sites/fleet.h"

namespace gapfarm {

struct FleetLoopOptions {
  FleetOptions fleet;
  std::string endpoint;  // the master's
  LinkSecurity security;
  // Without a master for so long, jobs are taken away (their workers leave by themselves, too), and
  // the fleet waits for the next; after `master_limit_s` it ends.  A master that is moved to
  // another machine has had the time to start there by then.
  double wait_limit_s = 30;
  double master_limit_s = 600;
  // Taking away may take so long.
  double drain_limit_s = 60;
};

enum class FleetEnd { kMasterLeft, kNoMaster, kStopped };

// Runs until the master says goodbye, or is gone for too long, or `stop` is requested; then nothing
// stands any more.  Error: jobs that could not be taken away, or the master cannot be talked to.
Result<FleetEnd> run_fleet(const FleetLoopOptions& options, StopSource& stop,
                           const std::function<void(const std::string&)>& note);

}  // namespace gapfarm
