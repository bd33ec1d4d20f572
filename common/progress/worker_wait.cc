#include "common/progress/worker_wait.h"

#include "common/progress/number_text.h"

namespace gapfarm {
namespace {

constexpr double kGrace_s = 1, kLocalGrace_s = 5;
constexpr double kPatience_s = 30;

// Nobody connects to "every address of this machine".
std::string reachable(const std::string& endpoint) {
  for (const std::string any : {"tcp://0.0.0.0:", "tcp://*:", "tcp://[::]:"}) {
    if (endpoint.rfind(any, 0) == 0) return "tcp://THIS_HOST:" + endpoint.substr(any.size());
  }
  return endpoint;
}

}  // namespace

WorkerWait::WorkerWait(const std::vector<std::string>& endpoints) {
  for (const std::string& endpoint : endpoints) {
    where_ += (where_.empty() ? " at " : ", ") + endpoint;
    if (connect_.empty()) connect_ = reachable(endpoint);
  }
}

std::optional<std::string> WorkerWait::message(std::size_t workers, double now_s) {
  if (workers > 0) {
    since_s_.reset();
    return std::nullopt;
  }
  if (!since_s_) since_s_ = now_s;
  const double waited_s = now_s - *since_s_;
  if (waited_s < (connect_.empty() ? kLocalGrace_s : kGrace_s)) return std::nullopt;
  std::string text = "waiting for " + std::string(connect_.empty() ? "local workers" : "workers") +
                     where_ + ", for " + format_duration(waited_s) + " now";
  if (waited_s >= kPatience_s) {
    text += connect_.empty() ? "; do they start?  See the lines above"
                             : "; start one with `gapfarm-worker --connect " + connect_ + "`";
  }
  return text;
}

}  // namespace gapfarm
