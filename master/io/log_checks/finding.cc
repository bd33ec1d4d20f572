#include "master/io/log_checks/finding.h"

#include <algorithm>
#include <map>

namespace gapfarm {

std::string finding_phrase(const SanityFinding& finding) {
  static const std::map<std::string, std::string> phrases = {
      {"impure", "the program has two answers to one question"},
      {"axes_swapped", "x and y are swapped"},
      {"axis_mirrored", "an axis is mirrored"},
      {"heading_flipped", "headings count clockwise"},
      {"heading_turned", "headings are counted from another axis"},
      {"sides_swapped", "left and right are exchanged"},
      {kEndsSwapped, "before and after are exchanged"},
      {"direction_reversed", "the motors run backward"},
      {"commands_unrelated", "commands and motions do not belong together"},
      {"unit_error", "it is in another unit"},
      {"slow_runs", "the robot hardly moves, as if times were in another unit"},
      {"robot_out_of_bounds", "this is no robot that the scenario can be"},
      {"base_not_simulated", "the base model cannot be simulated"},
      {"base_on_bounds", "the tuned base sits on its bounds"},
      {"base_misses", "the tuned base misses by far more than the noise"},
      {"unfinished", "a simulation failed on the way"},
      {"no_motion", "nothing moved"},
      {"too_few_trials", "there are too few trials"},
      {"duplicates", "trials are repeated"},
      {"clock_backward", "time runs backward"},
      {"frames_apart", "finger and pieces are not in one frame"},
      {"untouched", "the finger does not touch the pieces"},
      {"headings_rounded", "headings are rounded"},
      {"impossible_rows", "some rows cannot be"},
      {"false_readings", "some readings are false"},
      {"tip_jumps", "the finger jumps"}};
  const auto found = phrases.find(finding.name);
  if (found != phrases.end()) return found->second;
  std::string words = finding.name;
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

const char* severity_name(Severity severity) {
  constexpr const char* kNames[] = {"note", "doubt", "unusable"};
  return kNames[static_cast<std::size_t>(severity)];
}

}  // namespace gapfarm
