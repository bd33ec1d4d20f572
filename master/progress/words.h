// Times and shares in words.
#pragma once

#include <string>

namespace gapfarm {

// "1 h 02 min", "3 min 20 s", "12 s", "0.4 s"; "?" for what is no time.
std::string format_duration(double seconds);

// "0 %", "0.4 %", "37 %"; "100 %" only for all of it.
std::string format_share(double share);

}  // namespace gapfarm
