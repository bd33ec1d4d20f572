#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/base/clock.h"
#include "worker/service.h"

namespace gapfarm {
namespace {

ProcessPoolOptions pool_options(const SupervisorOptions& options) {
  ProcessPoolOptions pool;
  pool.program = options.program;
  pool.count = options.processes;
  pool.name_prefix = options.name;
  pool.failure_limit = {};
  pool.limits = options.limits;
  // It would not find the time for a job, or a master, as the one before did not.
  pool.replaces_leavers = !options.leaves_for_good && !std::isfinite(options.deadline_s);
  pool.arguments = [arguments = options.arguments, prefix = options.name,
                    deadline = options.deadline_s](const std::string& name,
                                                   const ProcessEnded* replaced) {
    std::vector<std::string> all = arguments;
    all.insert(all.end(), {"--name", name, "--process"});
    // One speaks for all: the first place's.
    if (name.rfind(prefix + "-1.", 0) == 0) all.push_back("--announce");
    if (replaced != nullptr) {
      all.insert(all.end(),
                 {"--replaces", replaced->name, "--replaced-end",
                  std::to_string(static_cast<int>(replaced->cause)), "--replaced-epoch",
                  std::to_string(replaced->epoch), "--replaced-attempt",
                  std::to_string(replaced->attempt), "--replaced-failure", replaced->failure});
    }
    if (std::isfinite(deadline)) {
      const double left = std::max(deadline - monotonic_seconds(), 0.001);
      all.insert(all.end(), {"--lifetime", std::to_string(left)});
    }
    return all;
  };
  return pool;
}

void wait_for(const ProcessPool& pool, const StopSource& stop, double timeout_s) {
  std::vector<pollfd> polled = {{stop.fd(), POLLIN, 0}};
  for (int fd : pool.fds()) polled.push_back({fd, POLLIN, 0});
  poll(polled.data(), polled.size(), static_cast<int>(std::ceil(timeout_s * 1000)));
}

}  // namespace

Result<int> supervise(const SupervisorOptions& options, StopSource& stop) {
  ProcessPool pool(pool_options(options));
  RETURN_IF_ERROR(pool.start(monotonic_seconds()));
  const bool mortal = options.leaves_for_good || std::isfinite(options.deadline_s);
  unsigned stops = 0;
  bool no_master = false;
  std::string last_end;
  while (!pool.exhausted()) {
    if (stop.requests() != stops) {
      stops = stop.requests();
      stop.acknowledge();
      pool.retire();
      pool.signal_all(SIGTERM);
    }
    const double now = monotonic_seconds();
    if (now >= options.deadline_s) pool.retire();
    for (const ProcessEnded& end : pool.reap(now)) {
      if (stops > 0) continue;
      last_end = end.text;
      no_master |= end.exit_status == kExitNoMaster;
      std::fprintf(stderr, "gapfarm-worker: %s%s\n", end.text.c_str(),
                   end.gave_up ? "; it is not started again" : "");
    }
    wait_for(pool, stop, std::clamp(pool.next_start() - now, 0.0, pool.look_interval()));
  }
  if (stops == 0 && no_master) return kExitNoMaster;
  if (stops > 0 || mortal) return 0;
  return Error{"no worker process can be kept alive: " + last_end};
}

}  // namespace gapfarm
