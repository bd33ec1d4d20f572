// Small logs for the tests of this folder.
#pragma once

#include <string>
#include <vector>

#include "tests/temporary_folder.h"

namespace gapfarm {

inline const std::vector<std::string> kCommands = {"forward", "backward", "turn_ccw",
                                                   "turn_cw", "wide_ccw", "wide_cw"};
inline const std::string kHeader =
    "session,trial,t,command,left,right,duration,x0,y0,theta0,x1,y1,theta1";
inline const std::string kRow = "s1,0,0,forward,1,1,1,0,0,0,0.25,0,0";

}  // namespace gapfarm
