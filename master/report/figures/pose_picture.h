// The picture of measured against simulated end poses (`poses.svg`).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/pose/pose.h"
#include "common/problem/problem.h"
#include "gapfarm/v1/task.pb.h"

namespace gapfarm {

// Predicted end poses of one command.
struct PoseCloud {
  std::string label;    // "before", "after"
  Pose mean;            // start frame
  Eigen::Matrix3d cov;  // of the end pose in the mean's own axes: m^2, m rad, rad^2
};

// One command.  All poses are ends seen from the start (x ahead, y left).
struct PosePanel {
  std::string title;
  std::vector<Pose> measured;
  std::vector<PoseCloud> clouds;  // at most kPoseCloudStyles; the last one is drawn on top
};

inline constexpr std::size_t kPoseCloudStyles = 3;

// One panel a command, three in a row: measured end poses as dots whose ticks point along their
// heading; each cloud as a mark with its heading and the ellipse that holds 90 % of its positions.
// Axes are equal and in mm.  A panel shows all clouds and the bulk of the measured poses; those
// beyond it are counted in a corner.  Shapes and line styles differ as well as colours.
std::string pose_picture(const std::vector<PosePanel>& panels, const std::string& title,
                         const std::string& subtitle = "");

// From predictions of a log to the panels of pose_picture().
struct PredictionOfLog {
  std::string label;
  v1::PredictResult prediction;  // one a trial of the problem's log, in its order, with covariances
};

// One panel a command: its trials at the duties and duration that the log has most of.
std::vector<PosePanel> pose_panels(const Problem& problem,
                                   const std::vector<PredictionOfLog>& predictions);

}  // namespace gapfarm
