#include "master/command/signals.h"

#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cassert>
#include <cerrno>

namespace gapfarm {
namespace {

// A handler takes no argument, so the one instance that signals go to has to be global.
std::atomic<StopSource*> target{nullptr};

void handle(int signal) {
  const int saved_errno = errno;
  StopSource* stop = target.load();
  if (!stop || stop->requested()) _exit(128 + signal);
  stop->request(signal);
  errno = saved_errno;
}

void install(void (*handler)(int)) {
  struct sigaction action = {};
  sigemptyset(&action.sa_mask);
  action.sa_handler = handler;  // without SA_RESTART, so that blocking calls return
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

}  // namespace

UserInterrupts::UserInterrupts(StopSource* stop) {
  assert(target.load() == nullptr);
  target.store(stop);
  install(handle);
}

UserInterrupts::~UserInterrupts() {
  install(SIG_DFL);
  target.store(nullptr);
}

}  // namespace gapfarm
