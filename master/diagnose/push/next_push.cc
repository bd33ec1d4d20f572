#include "master/diagnose/push/push_subject.h"

namespace gapfarm {

Result<std::vector<NextExperiment>> next_pushes(Farm& /*farm*/, const Problem& /*problem*/,
                                                const Rivals& /*rivals*/) {
  return std::vector<NextExperiment>{};
}

}  // namespace gapfarm
