#include <array>

#include "worker/scenarios/scenario.h"

namespace gapfarm {
namespace {

constexpr const char* kFollowsRuns =
    "it follows logged commands: there are no commands of its own to plan or trace; use gapfarm "
    "horizons";

}  // namespace

std::span<const Scenario> scenarios() {
  static constexpr std::array rows = {
      Scenario{"srv1", "tracked robot, six atomic commands", prepare_srv1},
      Scenario{"push", "flat pieces pushed across a table by a finger", prepare_push},
      Scenario{"ground", "any robot on wheels or tracks, from its file", prepare_ground, kPredicts,
               kFollowsRuns},
      Scenario{"external", "commands driven by a program of the user's", prepare_external},
      Scenario{"external_runs", "runs followed by a program of the user's", prepare_external,
               kPredicts, kFollowsRuns},
      Scenario{"objective", "a number that a program of the user's makes of values",
               prepare_objective, kEvaluates,
               "scenario objective has values and a number: nothing moves that could be predicted, "
               "logged or traced"},
      Scenario{"racquetball", "ball in a closed court, struck by a paddle", prepare_racquetball,
               kTraces,
               "scenario racquetball has paths and no trials: nothing can be predicted or logged; "
               "use gapfarm influence"},
  };
  return rows;
}

}  // namespace gapfarm
