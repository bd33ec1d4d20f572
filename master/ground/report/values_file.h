// values.json of a ground robot's diagnosis: what its file had and what the log says, for programs
// and for gapfarm export.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/base/interval.h"
#include "common/base/result.h"
#include "common/robot/robot.h"

namespace gapfarm {

// A number of the kinematic model.
struct ReportedValue {
  std::string name;  // "separation", "left", ...
  double had = 0;    // by the robot's file
  double reported = 0;
  Interval interval;   // 90 %
  bool named = false;  // the log says that it is another; else it is within what files are off by
};

struct ReportedValues {
  GroundRobot given;              // the robot as its file has it
  std::vector<std::string> logs;  // folders
  std::vector<ReportedValue> values;
};

// A list of {name, had, says, lo, hi, named}.
nlohmann::ordered_json values_json(const std::vector<ReportedValue>& values);
std::string format_values(const ReportedValues& values);
// Errors: `path` names the text, which is no such file.
Result<ReportedValues> parse_values(const std::string& text, const std::string& path);

}  // namespace gapfarm
