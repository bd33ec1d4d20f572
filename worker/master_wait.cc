#include "worker/master_wait.h"

#include <cmath>

namespace gapfarm {
namespace {

constexpr double kInterval_s = 60;

}  // namespace

std::optional<std::string> MasterWait::message(bool working, double now_s) {
  if (working) {
    if (working_) return std::nullopt;
    working_ = true;
    since_s_.reset();
    return "working for the master at " + endpoint_;
  }
  if (!since_s_) {
    const bool lost = working_;
    working_ = false;
    since_s_ = reported_s_ = now_s;
    return (lost ? "the master has gone; waiting for the next at " : "waiting for a master at ") +
           endpoint_;
  }
  if (now_s - reported_s_ < kInterval_s) return std::nullopt;
  reported_s_ = now_s;
  const long minutes = std::lround((now_s - *since_s_) / 60);
  return "still waiting for a master at " + endpoint_ + ", for " + std::to_string(minutes) +
         " min now; does one listen there (`gapfarm evolve --listen`), and can this machine reach "
         "it?";
}

}  // namespace gapfarm
