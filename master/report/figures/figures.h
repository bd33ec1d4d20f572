// Lines with bands over a common axis, as SVG.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/pose/pose.h"
#include "common/problem/problem.h"
#include "common/svg/svg.h"
#include "gapfarm/v1/task.pb.h"

namespace gapfarm {

struct RobotReading;

struct ChartSeries {
  std::string name = {};                         // empty: not in the legend
  std::vector<SvgPoint> line = {};               // data units
  std::vector<SvgPoint> lower = {}, upper = {};  // ends of a band; empty: none
  bool arrows = false;                           // from each second point to the next
  std::vector<Pose> marks = {};  // each with a stroke along its heading, unless that is NaN
  std::string colour = {};       // empty: by the place among the series
  bool dashed = false;
  bool filled = false;  // the line surrounds a faint area
};

struct ChartLevel {  // a horizontal line
  std::string name;
  double y = 0;
};

struct ChartLabel {
  std::string text;
  SvgPoint at;              // data units
  SvgPoint beside_px = {};  // right of that and below
  SvgText style = {};
};

struct LineChart {
  std::string title, x_title, y_title;
  std::string note;                  // below the title
  double width = 860, height = 340;  // px, of the whole and of the plot
  bool log_x = false;
  bool log_y = false;       // points at or below 0 are omitted
  bool equal_axes = false;  // one unit of x is as long as one of y
  double least_span = 0;    // of equal axes
  bool whole_x = false;     // no ticks between integers
  // What is beyond is cut off at the frame; marks there are counted in the note.
  std::optional<double> x_least, x_most, y_least, y_most;
  std::vector<ChartSeries> series;
  std::vector<ChartLevel> levels;
  std::vector<ChartLabel> labels;
};

std::string line_chart(const LineChart& chart);
// Several as one picture, so many in a row.  With a title above all, the legend stands there once.
std::string line_charts(const std::vector<LineChart>& charts, std::size_t across,
                        const std::string& title = "", const std::string& subtitle = "");

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
  std::vector<PoseCloud> clouds;  // the last one is drawn on top
};

// One panel a command, three in a row: measured end poses as dots whose ticks point along their
// heading; each cloud as a mark with its heading and the ellipse that holds 90 % of its positions.
// Axes are equal and in mm.  A panel shows all clouds and the bulk of the measured poses; those
// beyond it are counted.  Line styles differ as well as colours.
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

// A robot from above: outlines, wheels with radii and loads, axles, centre of mass.
// REQUIRES: `completed` is the reading's robot as complete_robot() leaves it.
std::string draw_robot(const RobotReading& reading, const GroundRobot& completed);

}  // namespace gapfarm
