// Recordings and a map to the one format of runs (docs/formats.md).
#pragma once

#include <string>
#include <vector>

#include "common/recordings/run.h"
#include "master/io/logs/column_map.h"

namespace gapfarm {

struct ImportedRuns {
  RunLog log;
  double clock_start_s = 0;         // what was taken off every time of the recordings
  std::vector<std::string> report;  // what was taken and what was left, a sentence each
};

// Times in s from the first one, poses in m and rad about the world's upward axis, commands in SI.
// Rows without a number where one is needed, poses whose quaternion is none and times that go back
// are omitted and counted.  Errors: no rows of poses or commands where the map has them, a column
// that is not there, a clock that was set back, rims' speeds in m/s without a wheel radius.
Result<ImportedRuns> to_runs(const std::vector<Recording>& recordings, const LogMap& map);

// commands.csv, poses.csv, wheels.csv and gyro.csv (empty: there are none).
struct RunFiles {
  std::string commands, poses, wheels, gyro;
};
RunFiles format_runs(const RunLog& log);

}  // namespace gapfarm
