#include <google/protobuf/text_format.h>
#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/base/clock.h"
#include "worker/service.h"

namespace gapfarm {
namespace {

void wait_for(const ProcessPool& pool, const StopSource& stop, double timeout_s) {
  std::vector<pollfd> polled = {{stop.fd(), POLLIN, 0}};
  for (int fd : pool.fds()) polled.push_back({fd, POLLIN, 0});
  poll(polled.data(), polled.size(), static_cast<int>(std::ceil(timeout_s * 1000)));
}

// What says who a worker is, for option --process.
std::string greeting_of(const std::string& name, const ProcessEnded* replaced) {
  v1::Hello hello;
  hello.set_name(name);
  if (replaced != nullptr) {
    hello.set_replaces(replaced->name);
    hello.set_replaced_end(static_cast<std::uint32_t>(replaced->cause));
    hello.set_replaced_epoch(replaced->epoch);
    hello.set_replaced_attempt(replaced->attempt);
    hello.set_replaced_failure(replaced->failure);
  }
  std::string text;
  google::protobuf::TextFormat::PrintToString(hello, &text);
  return text;
}

}  // namespace

Result<int> supervise(ProcessPoolOptions options, const std::vector<std::string>& arguments,
                      double deadline_s, StopSource& stop) {
  const bool mortal = !options.replaces_leavers;
  options.arguments = [&arguments, deadline_s, first = options.name_prefix + "-1."](
                          const std::string& name, const ProcessEnded* replaced) {
    std::vector<std::string> all = arguments;
    all.insert(all.end(), {"--process", greeting_of(name, replaced)});
    if (std::isfinite(deadline_s)) {
      all.insert(all.end(), {"--deadline", std::to_string(deadline_s)});
    }
    // One speaks for all: the first place's.
    if (name.starts_with(first)) all.push_back("--announce");
    return all;
  };
  ProcessPool pool(std::move(options));
  RETURN_IF_ERROR(pool.start(monotonic_seconds()));
  unsigned stops = 0;
  bool no_master = false, refused = false;
  std::string last_end;
  while (!pool.exhausted()) {
    if (stop.requests() != stops) {
      stops = stop.requests();
      stop.acknowledge();
      pool.retire();
      pool.signal_all(SIGTERM);
    }
    const double now = monotonic_seconds();
    if (now >= deadline_s) pool.retire();
    for (const ProcessEnded& end : pool.reap(now)) {
      if (stops > 0) continue;
      last_end = end.text;
      no_master |= end.exit_status == kExitNoMaster;
      refused |= end.exit_status == kExitRefused;
      std::fprintf(stderr, "gapfarm-worker: %s%s\n", end.text.c_str(),
                   end.gave_up ? "; it is not started again" : "");
    }
    wait_for(pool, stop, std::clamp(pool.next_start() - now, 0.0, pool.look_interval()));
  }
  if (stops == 0 && no_master) return kExitNoMaster;
  if (stops > 0 || (mortal && !refused)) return 0;
  return Error{"no worker process can be kept alive: " + last_end};
}

}  // namespace gapfarm
