// From predictions of a log to the panels of pose_picture().
#pragma once

#include <string>
#include <vector>

#include "common/problem/problem.h"
#include "gapfarm/v1/task.pb.h"
#include "master/report/figures/pose_picture.h"

namespace gapfarm {

struct PredictionOfLog {
  std::string label;
  v1::PredictResult prediction;  // one a trial of the problem's log, in its order, with covariances
};

// One panel a command: its trials at the duties and duration that the log has most of.
std::vector<PosePanel> pose_panels(const Problem& problem,
                                   const std::vector<PredictionOfLog>& predictions);

}  // namespace gapfarm
