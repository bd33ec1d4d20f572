#include "master/diagnose/aliases.h"

#include <utility>

namespace gapfarm {
namespace {

constexpr std::pair<const char*, const char*> kPairs[] = {
    {"motor_deadband", "rolling_resistance"},
    {"com_offset", "marker_offset"},
    {"timing_offset", "motor_lag"}};  // how hard the motors brake decides what lag leaves behind

}  // namespace

std::vector<std::string> constant_aliases(const std::string& effect) {
  std::vector<std::string> aliases;
  for (const auto& [a, b] : kPairs) {
    if (effect == a) aliases.push_back(b);
    if (effect == b) aliases.push_back(a);
  }
  return aliases;
}

}  // namespace gapfarm
