// Small logs for the tests of this folder.
#pragma once

#include <string>
#include <vector>

#include "common/trials/text/trial_parser.h"
#include "tests/temporary_folder.h"

namespace gapfarm {

inline const std::vector<std::string> kCommands = {"forward", "backward", "turn_ccw",
                                                   "turn_cw", "wide_ccw", "wide_cw"};
inline const std::string kHeader =
    "session,trial,t,command,left,right,duration,x0,y0,theta0,x1,y1,theta1";
inline const std::string kRow = "s1,0,0,forward,1,1,1,0,0,0,0.25,0,0";

// Files by their texts alone.
inline Result<TrialLog> parse_pushes(std::string_view text, const std::string& file,
                                     std::span<const std::string> pieces) {
  Mistakes mistakes(false);
  TrialLog log = parse_log(kPushLogForm, text, file, pieces, mistakes);
  if (Status s = mistakes.status(); !s) return s.error();
  return log;
}

using AddSamples = void (*)(std::string_view text, const std::string& file,
                            const std::vector<TrialLog*>& logs, Mistakes& mistakes);

inline Status parse_samples(AddSamples add, std::string_view text, const std::string& file,
                            TrialLog& log) {
  Mistakes mistakes(false);
  add(text, file, {&log}, mistakes);
  return mistakes.status();
}

}  // namespace gapfarm
