// Lines with bands over a common axis, as SVG.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/svg/svg.h"

namespace gapfarm {

struct ChartSeries {
  std::string name;
  std::vector<SvgPoint> line = {};               // data units
  std::vector<SvgPoint> lower = {}, upper = {};  // ends of a band; empty: none
  bool dots = false;                             // a dot a point in place of the line
};

struct ChartLevel {  // a horizontal line
  std::string name;
  double y = 0;
};

struct LineChart {
  std::string title, x_title, y_title;
  bool log_x = false;
  bool log_y = false;                     // points at or below 0 are omitted
  bool equal_axes = false;                // one unit of x is as long as one of y
  bool whole_x = false;                   // no ticks between integers
  std::optional<double> y_least, y_most;  // what is beyond is cut off at the frame
  std::vector<ChartSeries> series;
  std::vector<ChartLevel> levels;
};

// The colour of the i-th series: Okabe and Ito's, then the same dashed.
std::string series_colour(std::size_t i);

std::string line_chart(const LineChart& chart);

struct ChartBar {
  std::string name;
  double value = 0, lower = 0, upper = 0;
  bool strong = false;  // filled; the others are outlined
};

// Horizontal bars from 0 with intervals, in the order given; `mark`: a vertical line.
std::string bar_chart(const std::string& title, const std::string& x_title,
                      const std::vector<ChartBar>& bars, std::optional<double> mark,
                      const std::string& mark_name);

}  // namespace gapfarm
