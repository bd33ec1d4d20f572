// What runs are called.
#pragma once

#include <string>

#include "common/recordings/run.h"

namespace gapfarm {

// Trial::session of a run's windows.
inline std::string session_of(const LoggedRun& run) {
  return run.session.empty() ? run.run : run.session + "/" + run.run;
}

}  // namespace gapfarm
