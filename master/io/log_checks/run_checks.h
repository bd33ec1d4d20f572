// What is wrong with logged runs of any ground robot.
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/recordings/run.h"
#include "master/io/log_checks/finding.h"

namespace gapfarm {

struct RunChecks {
  std::vector<SanityFinding> findings;
  // Which say nothing of how commands move a robot, or what another has said: ascending.
  std::vector<std::size_t> useless;
  std::set<std::pair<std::size_t, std::size_t>> false_poses = {};  // of which run, which
  bool gyro_is_wrong = false;                                      // it contradicts the headings

  bool none_is_left(const RunLog& log) const {
    return !useless.empty() && useless.size() == log.runs.size();
  }
};

// Runs whose poses never change, or crawl, though the robot is commanded to drive, that move though
// nothing is commanded, and that are another one's copy; stretches without any pose; commands that
// are older than the robot's timeout; a gyro of another sign, unit or clock than the headings.
RunChecks check_runs(const RunLog& log, std::optional<double> timeout_s = {});

// Poses that the tracker took from elsewhere, for they jump there and back.  REQUIRES: headings in
// radians.
RunChecks check_jumps(const RunLog& log);

// Without what these found.
RunLog without(RunLog log, const RunChecks& checks);

}  // namespace gapfarm
