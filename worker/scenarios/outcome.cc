#include "worker/scenarios/outcome.h"

namespace gapfarm {

v1::Outcome to_outcome(MotionOutcome outcome) {
  switch (outcome) {
    case MotionOutcome::kOk:
      return v1::OK;
    case MotionOutcome::kDiverged:
      return v1::DIVERGED;
    case MotionOutcome::kFellOver:
      return v1::FELL_OVER;
    case MotionOutcome::kNeverRested:
      return v1::NEVER_RESTED;
  }
  return v1::DIVERGED;
}

}  // namespace gapfarm
