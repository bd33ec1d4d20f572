// The log as a diagnosis works on it, and what is reported where it cannot.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/problem/problem.h"
#include "master/diagnose/diagnose.h"
#include "master/io/log_checks/finding.h"

namespace gapfarm {

// A log and config in the log's own frame, without rows that cannot be.
struct PreparedLog {
  Problem problem;
  // World position of that frame's origin, whole metres: (0, 0) for a log near the world's origin,
  // else its middle, so that places stay within the parameters' bounds wherever a map begins.
  double frame_x_m = 0, frame_y_m = 0;
  std::vector<SanityFinding> sanity;
};
// `frame_m`: what it has to be, where that is known.
PreparedLog prepare_log(const Problem& problem,
                        const std::optional<Eigen::Vector2d>& frame_m = std::nullopt);

// The answer where a log cannot be used, without any simulation.
DiagnosisResult unusable_result(const PreparedLog& log);

}  // namespace gapfarm
