#include <array>

#include "worker/scenarios/scenario.h"

namespace gapfarm {
std::span<const Scenario> scenarios() {
  static constexpr std::array rows = {
      Scenario{"srv1", "tracked robot, six atomic commands", prepare_srv1},
      Scenario{"push", "flat pieces pushed across a table by a finger", prepare_push},
      Scenario{"ground", "any robot on wheels or tracks, from its file", prepare_ground},
      Scenario{"external", "commands driven by a program of the user's", prepare_external},
      Scenario{"external_runs", "runs followed by a program of the user's", prepare_external},
      Scenario{"objective", "a number that a program of the user's makes of values",
               prepare_objective},
      Scenario{"racquetball", "ball in a closed court, struck by a paddle", prepare_racquetball},
  };
  return rows;
}

}  // namespace gapfarm
