#include "common/net/master_wait.h"

#include <algorithm>
#include <cmath>

namespace gapfarm {
namespace {

// Doubled after each message: a log of a forgotten worker grows by one line an hour.
constexpr double kFirstInterval_s = 60;
constexpr double kLongestInterval_s = 3600;

constexpr const char* kRemedy =
    "does one listen there (`gapfarm evolve --listen`), and can this machine reach it?";

std::string duration(double seconds) {
  return seconds < 120 ? std::to_string(std::lround(seconds)) + " s"
                       : std::to_string(std::lround(seconds / 60)) + " min";
}

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
    since_s_ = now_s;
    interval_s_ = kFirstInterval_s;
    next_s_ = now_s + interval_s_;
    return (lost ? "the master has gone; waiting for the next at " : "waiting for a master at ") +
           endpoint_ +
           (limit_s_ > 0 ? ", and giving up when none has come in " + duration(limit_s_) : "");
  }
  if (now_s < next_s_) return std::nullopt;
  const std::string waited = duration(now_s - *since_s_);
  interval_s_ = std::min(2 * interval_s_, kLongestInterval_s);
  next_s_ = now_s + interval_s_;
  return "still waiting for a master at " + endpoint_ + ", for " + waited + " now" +
         (limit_s_ > 0 ? " of " + duration(limit_s_) : "") + "; " + kRemedy;
}

bool MasterWait::is_over(double now_s) const {
  return limit_s_ > 0 && since_s_ && now_s - *since_s_ > limit_s_;
}

std::string MasterWait::over() const {
  return "no master at " + endpoint_ + " for " + duration(limit_s_) + "; " + kRemedy;
}

}  // namespace gapfarm
