// What lies around each trial: what effects look at beside the command itself.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "common/trials/trial.h"

namespace gapfarm {

// What the motors were commanded in one trial, defaults filled in.
struct DrivenCommand {
  double left = 0;  // duty, [-1, 1]
  double right = 0;
  double duration_s = 0;
};

struct TrialContext {
  // Start of the command since the session began.  Where the log has no time: the start of the
  // trial before, plus its duration, plus kAssumedPause_s; 0 for the first of a session.
  double session_time_s = 0;
  // Sign of each side's last nonzero duty in the session before this trial; 0: it never ran.
  int last_left = 0;
  int last_right = 0;
  // The robot was moved by hand before this trial, or it is the first of its session.
  bool moved = true;
  // Trials since the last unrecorded move; 0 for a trial after one.
  int place_in_run = 0;
  // The trial before it in the session.
  std::optional<std::size_t> previous;
};

// Seconds between commands where nothing was logged: people and scripts take about as long.
inline constexpr double kAssumedPause_s = 4;

// A start pose farther than this from the end pose before it means that the robot was moved.
struct MoveTolerance {
  double distance_m = 0;
  double heading_rad = 0;
};

// Estimated from the gaps between each trial's end pose and the next one's start pose.  The smaller
// gaps are the noise of measuring one resting pose twice: distances follow a Rayleigh law, headings
// a folded normal one.  Their scale is taken from the lower quartile (so half of the gaps may be
// moves), refined by the median of the gaps within five scales, and five scales are the tolerance:
// one trial in 270,000 that did not move is beyond it.  It is kept within [2 cm, 5 cm] and [0.1
// rad, 0.35 rad]: logs that share one measurement have no noise to see but round to a centimetre,
// and in logs where every trial was moved the quartile means nothing.  Of positions that lie on a
// grid it is no less than what rounding one resting pose twice may put between them.
MoveTolerance estimate_move_tolerance(const TrialLog& log);

// One context a trial, in the log's order; `known`: the log's tolerance.  REQUIRES: one
// command a trial.
std::vector<TrialContext> trial_contexts(const TrialLog& log,
                                         std::span<const DrivenCommand> commands,
                                         const std::optional<MoveTolerance>& known = {});

}  // namespace gapfarm
