#include "worker/sim/robot/motion.h"

namespace gapfarm {

const char* outcome_name(MotionOutcome outcome) {
  switch (outcome) {
    case MotionOutcome::kOk:
      return "ok";
    case MotionOutcome::kDiverged:
      return "diverged";
    case MotionOutcome::kFellOver:
      return "fell_over";
    case MotionOutcome::kNeverRested:
      return "never_rested";
  }
  return "unknown";
}

}  // namespace gapfarm
